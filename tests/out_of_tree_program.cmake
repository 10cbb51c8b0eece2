# The steps of the author of a program that renders with libcrt: install crt, move the tree, build
# docs/example_program against it by find_package and by pkg-config, run it from another folder with an empty
# environment, and check the image. After the install the test uses nothing of the source or build tree of
# crt.
#
#   cmake -DSOURCE_DIR=… -DBUILD_DIR=… -DWORK_DIR=… -DGENERATOR=… -DCXX_COMPILER=…
#     [-DCXX_FLAGS=…]
#   [-DPKG_CONFIG=…] -P out_of_tree_program.cmake

include(${CMAKE_CURRENT_LIST_DIR}/trees.cmake)
set(RUN_FOLDER ${WORK_DIR}/elsewhere)

# Renders, and looks whether all of the image came out: not black, and through the installed codec module.
function(expect_image program image)
  run(env -i HOME=${WORK_DIR}/home SOURCE_DATE_EPOCH=0 ASAN_OPTIONS=detect_leaks=0 ${program} ${image})
  if(NOT output MATCHES "error of the image: [0-9.]+ %")
    message(FATAL_ERROR "${program} did not render as it should:\n${output}")
  endif()
  file(READ ${WORK_DIR}/elsewhere/${image} signature LIMIT 8 HEX)
  if(NOT signature STREQUAL "89504e470d0a1a0a")
    message(FATAL_ERROR "${program} wrote ${image}, which is no PNG: ${signature}")
  endif()
  file(SIZE ${WORK_DIR}/elsewhere/${image} bytes)
  if(bytes LESS 20000)
    message(FATAL_ERROR "${image} of ${bytes} bytes holds no picture of 320 × 240 noisy pixels")
  endif()
endfunction()

file(REMOVE_RECURSE ${WORK_DIR})
file(MAKE_DIRECTORY ${WORK_DIR}/elsewhere)
install_and_move()
build_example(example_program)
expect_image(${WORK_DIR}/build/example_program package.png)

# A separate account has installed crt, and another account runs the program. libcrt also trusts plugins
# that its owner has written.
execute_process(COMMAND id -u OUTPUT_VARIABLE user OUTPUT_STRIP_TRAILING_WHITESPACE)
if(user STREQUAL "0")
  run(chown -R 65534:65534 ${WORK_DIR}/moved)
  expect_image(${WORK_DIR}/build/example_program other_owner.png)
endif()

# The interface needs nothing but C++17, and no header of the rooms.
if(PKG_CONFIG)
  run(${CMAKE_COMMAND} -E env PKG_CONFIG_PATH=${WORK_DIR}/moved/lib/pkgconfig ${PKG_CONFIG} --cflags --libs
    crt)
  string(STRIP "${output}" flags)
  separate_arguments(flags UNIX_COMMAND "${flags} ${CXX_FLAGS}")
  run(${CXX_COMPILER} -std=c++17 -Wall -Wextra -Werror ${WORK_DIR}/example_program/example_program.cpp -o
    ${WORK_DIR}/by_pkg_config
      ${flags} -Wl,-rpath,${WORK_DIR}/moved/lib)
  expect_image(${WORK_DIR}/by_pkg_config pkg_config.png)
  # The same scene, seed and samples: the same picture.
  run(${CMAKE_COMMAND} -E compare_files ${WORK_DIR}/elsewhere/package.png
    ${WORK_DIR}/elsewhere/pkg_config.png)
endif()

file(REMOVE_RECURSE ${WORK_DIR})
