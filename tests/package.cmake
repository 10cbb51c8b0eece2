# The Debian package: made by cpack, unpacked with dpkg into a folder, and used from there. It must name the
# libraries that it needs, and hold the program, its data, its manual and the completion of shells.
#
#   cmake -DBUILD_DIR=… -DWORK_DIR=… -DCPACK=… -P package.cmake

include(${CMAKE_CURRENT_LIST_DIR}/trees.cmake)
set(RUN_FOLDER ${WORK_DIR})

file(REMOVE_RECURSE ${WORK_DIR})
file(MAKE_DIRECTORY ${WORK_DIR})
run(${CPACK} -G DEB --config ${BUILD_DIR}/CPackConfig.cmake -B ${WORK_DIR}/made)
file(GLOB packages ${WORK_DIR}/made/*.deb)
list(LENGTH packages count)
if(NOT count EQUAL 1)
  message(FATAL_ERROR "cpack made ${count} packages: ${packages}")
endif()

run(dpkg-deb --field ${packages} Depends)
foreach(library libc6 libyaml-cpp libfmt libspdlog libzstd libopenexr libopenimageio libpng)
  if(NOT output MATCHES "(^|, )${library}")
    message(FATAL_ERROR "the package does not depend on ${library}: ${output}")
  endif()
endforeach()

run(dpkg-deb --extract ${packages} ${WORK_DIR}/unpacked)
set(usr ${WORK_DIR}/unpacked/usr)
foreach(file bin/crt lib/crt/crt_image_exr.so lib/crt/crt_image_oiio.so
  lib/crt/crt_image_plain.so
  share/crt/data/cornell/white.csv
  share/crt/configs/shared/cornell_room.yaml
        share/crt/meshes/sphere.obj share/man/man1/crt.1 share/bash-completion/completions/crt
        share/zsh/vendor-completions/_crt share/fish/vendor_completions.d/crt.fish share/doc/crt/README.md
        share/doc/crt/scene.md share/doc/crt/example_backend/example_backend.cpp)
  if(NOT EXISTS ${usr}/${file})
    message(FATAL_ERROR "the package has no ${file}")
  endif()
endforeach()

# Without a trace of this build: an empty environment, and a scene that includes, names data and has a mesh.
set(clean env -i ASAN_OPTIONS=detect_leaks=0)
run(${clean} ${usr}/bin/crt render ${usr}/share/crt/configs/cornell_sphere.yaml --set
  film.resolution=[32,32] --spp 2
    --report none -o a.exr -o a.png)
foreach(image a.exr a.png)
  if(NOT EXISTS ${WORK_DIR}/${image})
    message(FATAL_ERROR "the packaged crt ended well, but there is no ${image}")
  endif()
endforeach()
run(${clean} ${usr}/bin/crt data)
if(NOT output MATCHES "cornell/white")
  message(FATAL_ERROR "the packaged crt does not find its data:\n${output}")
endif()
file(REMOVE_RECURSE ${WORK_DIR})
