# Functions of the tests of installed, packed and moved trees. They work in WORK_DIR.
include(${CMAKE_CURRENT_LIST_DIR}/../cmake/Run.cmake)

# Installs crt and moves it to ${WORK_DIR}/moved.
function(install_and_move)
  run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${WORK_DIR}/installed)
  file(RENAME ${WORK_DIR}/installed ${WORK_DIR}/moved)
endfunction()

# Builds a copy of docs/${example} in ${WORK_DIR}/build, against the crt that was moved.
function(build_example example)
  file(COPY ${SOURCE_DIR}/docs/${example} DESTINATION ${WORK_DIR})
  run(${CMAKE_COMMAND} -G ${GENERATOR} -S ${WORK_DIR}/${example} -B ${WORK_DIR}/build
      -DCMAKE_PREFIX_PATH=${WORK_DIR}/moved -DCMAKE_CXX_COMPILER=${CXX_COMPILER}
      "-DCMAKE_CXX_FLAGS=${CXX_FLAGS}")
  run(${CMAKE_COMMAND} --build ${WORK_DIR}/build)
endfunction()
