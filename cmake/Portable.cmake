# The target `portable`: crt in three archives for machines on which nothing can be installed, a cluster's
# nodes say.
#
#   crt-portable.tar.gz        the program, its backends, scenes, meshes, and the libraries they need but
#   glibc's and the compiler's
#   crt-portable-tests.tar.gz  the conformance suite and its reference backend, to be unpacked over the first
#   crt-portable-bench.tar.gz  the programs of bench/run paper, likewise
#
# Unpacked anywhere, bin/crt runs, if the machine's glibc and libstdc++ are not older than this one's.
# OpenImageIO and the 250 libraries it brings stay behind, being larger than all the rest, and the libraries
# of other image formats with it: images are written as .pfm and .ppm, not .exr and .png. The machine has its
# own driver of the GPU, and its own NVRTC.
#
# Run as a script (cmake -P) it makes the archives from a build tree; the target does so with everything
# built.

if(CMAKE_SCRIPT_MODE_FILE)
  include(${CMAKE_CURRENT_LIST_DIR}/Run.cmake)
  set(staging ${BUILD_DIR}/portable)
  file(REMOVE_RECURSE ${staging})

  # Packs ${staging}/${name}/crt into ${name}.tar.gz.
  function(pack name)
    set(tree ${staging}/${name}/crt)
    file(GLOB_RECURSE binaries ${tree}/bin/* ${tree}/lib/*.so ${tree}/lib/*.so.*)
    run(${STRIP} --strip-unneeded ${binaries})
    run(${CMAKE_COMMAND} -E chdir ${staging}/${name} ${CMAKE_COMMAND} -E tar czf ${BUILD_DIR}/${name}.tar.gz
      crt)
    file(GLOB_RECURSE files ${tree}/*)
    set(bytes 0)
    foreach(file IN LISTS files)
      file(SIZE ${file} size)
      math(EXPR bytes "${bytes} + ${size}")
    endforeach()
    file(SIZE ${BUILD_DIR}/${name}.tar.gz packed)
    math(EXPR kib "(${bytes} + 1023) / 1024")
    math(EXPR packed_kib "(${packed} + 1023) / 1024")
    message(STATUS "${BUILD_DIR}/${name}.tar.gz: ${packed_kib} KiB, unpacked ${kib} KiB")
  endfunction()

  set(tree ${staging}/crt-portable/crt)
  run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${tree})
  file(REMOVE_RECURSE ${tree}/include ${tree}/lib/cmake ${tree}/lib/pkgconfig ${tree}/share/doc)
  file(GLOB archives ${tree}/lib/*.a ${tree}/lib/libcrt.so*)
  file(GLOB image_modules ${tree}/lib/crt/crt_image_*.so)
  file(REMOVE ${archives} ${image_modules})
  file(COPY ${BUILD_DIR}/bin/crt-meshgen DESTINATION ${tree}/bin)

  # glibc must fit the kernel and the dynamic loader of the machine, and its drivers may need a newer
  # libstdc++ than ours: those are its own.
  file(GLOB backends ${tree}/lib/crt/*.so)
  file(GET_RUNTIME_DEPENDENCIES
    EXECUTABLES ${tree}/bin/crt MODULES ${backends}
    RESOLVED_DEPENDENCIES_VAR libraries
    POST_EXCLUDE_REGEXES "/ld-linux[^/]*$" "/lib(c|m|dl|rt|pthread|gcc_s|stdc\\+\\+)\\.so[^/]*$")
  foreach(library IN LISTS libraries)
    file(COPY ${library} DESTINATION ${tree}/lib FOLLOW_SYMLINK_CHAIN)
  endforeach()

  # `cmake --install` puts the suite into the program's tree. Here it moves to a separate tree. `crt verify`
  # works where both are unpacked in the same place.
  set(tests ${staging}/crt-portable-tests/crt)
  file(COPY ${REFERENCE_BACKEND} DESTINATION ${tests}/lib/crt)
  file(MAKE_DIRECTORY ${tests}/bin)
  file(RENAME ${tree}/bin/crt_conformance ${tests}/bin/crt_conformance)
  foreach(program paper_host paper_gpu)
    if(EXISTS ${BUILD_DIR}/bin/${program})
      file(COPY ${BUILD_DIR}/bin/${program} DESTINATION ${staging}/crt-portable-bench/crt/bin)
    endif()
  endforeach()
  pack(crt-portable)
  pack(crt-portable-tests)
  pack(crt-portable-bench)
  file(REMOVE_RECURSE ${staging})
  return()
endif()

add_custom_target(portable
  COMMAND ${CMAKE_COMMAND} -DBUILD_DIR=${PROJECT_BINARY_DIR} -DSTRIP=${CMAKE_STRIP}
  -DREFERENCE_BACKEND=$<TARGET_FILE:crt_backend_example>
          -P ${CMAKE_CURRENT_LIST_FILE}
  COMMENT "Packing crt-portable.tar.gz"
  VERBATIM)
# The targets whose files are installed or copied from the build tree.
foreach(part crt crt_backend_cuda crt_backend_embree crt_backend_opencl
  crt_image_exr crt_image_oiio crt_image_plain
  crt_kernel_cache crt_meshes crt_shell_files crt-meshgen
        conformance crt_backend_example libcrt paper_host paper_gpu)
  if(TARGET ${part})
    add_dependencies(portable ${part})
  endif()
endforeach()
