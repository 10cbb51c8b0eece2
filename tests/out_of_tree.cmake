# The steps of a backend's author: install crt, move the tree, and build docs/example_backend against it. crt
# must load the backend, and the backend must pass the conformance suite. After the install the test uses
# nothing of the source or build tree of crt but that suite.
#
#   cmake -DSOURCE_DIR=… -DBUILD_DIR=… -DWORK_DIR=… -DGENERATOR=… -DCXX_COMPILER=…
#     [-DCXX_FLAGS=…] -P out_of_tree.cmake

include(${CMAKE_CURRENT_LIST_DIR}/trees.cmake)

# `crt plugins` gives each backend an unindented line with its name, then indented ones about it.
function(expect_usable listing when)
  if(NOT listing MATCHES "(^|\n)example 1\\.0\\.0\n(( [^\n]*\n)*)")
    message(FATAL_ERROR "${when}: crt plugins does not list the example backend:\n${listing}")
  endif()
  set(about "${CMAKE_MATCH_2}")
  if(about MATCHES "cannot run" OR NOT about MATCHES "portable C\\+\\+, one thread")
    message(FATAL_ERROR "${when}: the example backend is not usable:\n${about}")
  endif()
endfunction()

file(REMOVE_RECURSE ${WORK_DIR})
install_and_move()
build_example(example_backend)
run(${CMAKE_COMMAND} -E env CRT_BACKEND_PATH=${WORK_DIR}/build ${WORK_DIR}/moved/bin/crt plugins)
expect_usable("${output}" "by CRT_BACKEND_PATH")

# The border's part of the conformance suite, on the backend that crt has never seen, and the comparison of
# its kernels, which a backend with a single kernel must pass.
run(${CMAKE_COMMAND} -E env CRT_BACKEND_PATH=${WORK_DIR}/build ${BUILD_DIR}/bin/crt_conformance --backend
  example --against example "[abi],a kernel with everything in it*")
if(NOT output MATCHES "All tests passed" OR NOT output MATCHES "has one kernel for all scenes")
  message(FATAL_ERROR "the out-of-tree backend was not tested:\n${output}")
endif()

# Its bits against those of another backend, as its README says: the command names neither that backend nor
# that this one has a single kernel.
if(EXISTS ${BUILD_DIR}/lib/crt/crt_backend_embree.so)
  run(${CMAKE_COMMAND} -E env CRT_BACKEND_PATH=${WORK_DIR}/build ${BUILD_DIR}/bin/crt_conformance --backend
    example "the same bits as*")
  if(NOT output MATCHES "All tests passed" OR NOT output MATCHES "those of 'embree'")
    message(FATAL_ERROR "the bits of the out-of-tree backend were not tested:\n${output}")
  endif()
endif()

# And physics, by the crt that was installed.
run(${WORK_DIR}/moved/bin/crt verify --backend example --plugin-path ${WORK_DIR}/build --case
  furnace,square-light,reflectance,out-of-glass,prism,crops)
if(NOT output MATCHES "6 pass")
  message(FATAL_ERROR "crt verify did not pass the out-of-tree backend:\n${output}")
endif()

run(${CMAKE_COMMAND} --install ${WORK_DIR}/build --prefix ${WORK_DIR}/moved)
run(${CMAKE_COMMAND} -E env --unset=CRT_BACKEND_PATH ${WORK_DIR}/moved/bin/crt plugins)
expect_usable("${output}" "installed beside the other backends")

file(REMOVE_RECURSE ${WORK_DIR})
