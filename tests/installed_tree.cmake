# crt runs without its build tree: a tree that `cmake --install` has made and that was moved, and a package
# of the target `portable` that was unpacked. Both render with an empty environment from an unrelated folder.
#
#   cmake -DMODE=install|portable -DBUILD_DIR=… -DWORK_DIR=… [-DSTRIP=… -DREFERENCE_BACKEND=…
#   -DPORTABLE_SCRIPT=…] -P installed_tree.cmake

include(${CMAKE_CURRENT_LIST_DIR}/trees.cmake)
set(RUN_FOLDER ${WORK_DIR}/elsewhere)

# Renders a scene of the tree into `outputs`, small and with any backend, and looks whether the files are
# there.
function(render tree scene)
  set(options "")
  foreach(image IN LISTS ARGN)
    list(APPEND options -o ${image})
  endforeach()
  run(${CLEAN} ${tree}/bin/crt render ${tree}/share/crt/configs/${scene}.yaml --set film.resolution=[32,32]
    --spp 2 --report none ${options})
  foreach(image IN LISTS ARGN)
    if(NOT EXISTS ${WORK_DIR}/elsewhere/${image})
      message(FATAL_ERROR "crt ended well, but there is no ${image}:\n${output}")
    endif()
  endforeach()
endfunction()

# An empty environment; in a sanitizer's build without the search for leaks, for which the suppressions would
# be missing. Other builds do not read the variable.
set(CLEAN env -i ASAN_OPTIONS=detect_leaks=0)

file(REMOVE_RECURSE ${WORK_DIR})
file(MAKE_DIRECTORY ${WORK_DIR}/elsewhere)

if(MODE STREQUAL "install")
  install_and_move()
  render(${WORK_DIR}/moved cornell_box a.pfm a.exr a.png)
  render(${WORK_DIR}/moved cornell_figure b.pfm)  # reads a mesh
else()
  run(${CMAKE_COMMAND} -DBUILD_DIR=${BUILD_DIR} -DSTRIP=${STRIP} -DREFERENCE_BACKEND=${REFERENCE_BACKEND} -P
    ${PORTABLE_SCRIPT})
  # Small enough to be sent anywhere. The archive, too, is what it claims to be: only what it holds is used
  # from here on.
  set(limit 50331648)  # 48 MiB
  foreach(archive crt-portable crt-portable-tests)
    run(${CMAKE_COMMAND} -E chdir ${WORK_DIR} ${CMAKE_COMMAND} -E tar xzf ${BUILD_DIR}/${archive}.tar.gz)
    file(SIZE ${BUILD_DIR}/${archive}.tar.gz bytes)
    if(bytes GREATER limit)
      message(FATAL_ERROR "${archive}.tar.gz has ${bytes} bytes: more than ${limit}")
    endif()
  endforeach()
  # The unpacked package is small, too, apart from Embree's 42 MiB and the meshes, which are text.
  set(bytes 0)
  file(GLOB_RECURSE files ${WORK_DIR}/crt/*)
  list(FILTER files EXCLUDE REGEX "/share/crt/meshes/|/libembree")
  foreach(file IN LISTS files)
    if(NOT IS_SYMLINK ${file})
      file(SIZE ${file} size)
      math(EXPR bytes "${bytes} + ${size}")
    endif()
  endforeach()
  set(limit 17825792)  # 17 MiB, of both archives; decoders of Draco and meshopt and muParser are 1.9 of them
  if(bytes GREATER limit)
    message(FATAL_ERROR
      "crt-portable has ${bytes} bytes unpacked, meshes and Embree aside: more than ${limit}")
  endif()

  run(${CMAKE_COMMAND} -E chdir ${WORK_DIR} ${CMAKE_COMMAND} -E tar xzf
    ${BUILD_DIR}/crt-portable-bench.tar.gz)
  run(${CLEAN} ${WORK_DIR}/crt/bin/paper_host boxes --quick --runs 1 --meshes
    ${WORK_DIR}/crt/share/crt/meshes)

  render(${WORK_DIR}/crt cornell_box a.pfm a.ppm)
  render(${WORK_DIR}/crt cornell_figure b.pfm)
  render(${WORK_DIR}/crt cornell_dragon c.pfm)
  run(${CLEAN} ${WORK_DIR}/crt/bin/crt_conformance --backend example [abi])
  run(${CLEAN} ${WORK_DIR}/crt/bin/crt verify --backend example --case furnace)

  # The packed generator makes the packed meshes.
  file(MAKE_DIRECTORY ${WORK_DIR}/elsewhere/meshes)
  run(${CLEAN} ${WORK_DIR}/crt/bin/crt-meshgen ${WORK_DIR}/elsewhere/meshes)
  file(GLOB meshes RELATIVE ${WORK_DIR}/elsewhere/meshes ${WORK_DIR}/elsewhere/meshes/*)
  if(NOT meshes)
    message(FATAL_ERROR "crt-meshgen made nothing:\n${output}")
  endif()
  foreach(mesh IN LISTS meshes)
    run(${CMAKE_COMMAND} -E compare_files ${WORK_DIR}/elsewhere/meshes/${mesh}
      ${WORK_DIR}/crt/share/crt/meshes/${mesh})
  endforeach()

  # Nothing but glibc and the compiler's library comes from this machine.
  file(GLOB backends ${WORK_DIR}/crt/lib/crt/*.so)
  foreach(file IN LISTS backends ITEMS ${WORK_DIR}/crt/bin/crt)
    run(${CLEAN} ldd ${file})
    string(REGEX MATCHALL "lib[^ /]* => /[^ ]*" libraries "${output}")
    foreach(library IN LISTS libraries)
      if(NOT library MATCHES "=> ${WORK_DIR}/" AND NOT library MATCHES
        "^lib(c|m|dl|rt|pthread|gcc_s|stdc\\+\\+)\\.so")
        message(FATAL_ERROR "${file} needs a library that is not packed: ${library}")
      endif()
    endforeach()
  endforeach()
endif()

file(REMOVE_RECURSE ${WORK_DIR})
