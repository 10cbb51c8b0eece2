# The installed tree, which runs from any folder it is moved to:
#   bin/crt                      the program; looks for backends in ../lib/crt (installed by
#   core/CMakeLists.txt)
#   bin/crt_conformance          the suite for backends, which `crt verify` runs (verify/CMakeLists.txt)
#   lib/crt/                     backends (each installs itself, see CrtBackend.cmake)
#   share/crt/                   meshes and scenes (configs/), named data (data/)
#   share/doc/crt/               the manual, decisions, and the example of a backend
#   share/man, share/bash-completion, share/zsh, share/fish: what the table of commands says
#   (core/CMakeLists.txt)
#   lib/cmake/crt/, include/crt/ what find_package(crt) and crt_add_backend need to build further ones:
#   installed here
#   lib/libcrt.so.0, include/crt/*.h, lib/pkgconfig/crt.pc
#                                crt in other programs (docs/embedding.md): installed here

include(CMakePackageConfigHelpers)

set(CRT_INSTALL_CMAKE_DIR lib/cmake/crt)

install(TARGETS crt_backend_headers crt_kernel_cache libcrt EXPORT crtTargets ARCHIVE DESTINATION lib
  LIBRARY DESTINATION lib)
install(EXPORT crtTargets NAMESPACE crt:: DESTINATION ${CRT_INSTALL_CMAKE_DIR})

install(DIRECTORY ${PROJECT_SOURCE_DIR}/core/include/crt DESTINATION include FILES_MATCHING PATTERN "*.h")
install(FILES ${PROJECT_SOURCE_DIR}/docs/embedding.md DESTINATION share/doc/crt)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs/example_program DESTINATION share/doc/crt)
configure_file(${PROJECT_SOURCE_DIR}/cmake/crt.pc.in ${PROJECT_BINARY_DIR}/generated/crt.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/generated/crt.pc DESTINATION lib/pkgconfig)

install(FILES
  ${PROJECT_SOURCE_DIR}/core/backend/crt_backend.h
  ${PROJECT_BINARY_DIR}/generated/backend/crt_layout_hash.h
  DESTINATION include/crt/backend)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/core/backend/sdk/ DESTINATION include/crt/backend/sdk FILES_MATCHING
  PATTERN "*.h")
install(DIRECTORY ${PROJECT_SOURCE_DIR}/core/system/ DESTINATION include/crt/system FILES_MATCHING PATTERN
  "*.h")
install(DIRECTORY ${PROJECT_SOURCE_DIR}/core/kernel/ DESTINATION include/crt/kernel FILES_MATCHING PATTERN
  "*.h")

configure_package_config_file(
  ${PROJECT_SOURCE_DIR}/cmake/crtConfig.cmake.in ${PROJECT_BINARY_DIR}/generated/crtConfig.cmake
  INSTALL_DESTINATION ${CRT_INSTALL_CMAKE_DIR}
  NO_SET_AND_CHECK_MACRO)
# A backend is compiled against the exact structs of the scene blob, which any release may change before 1.0;
# after that the loader's layout hash still has the last word.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/generated/crtConfigVersion.cmake COMPATIBILITY
  SameMinorVersion)
install(FILES
  ${PROJECT_BINARY_DIR}/generated/crtConfig.cmake
  ${PROJECT_BINARY_DIR}/generated/crtConfigVersion.cmake
  ${PROJECT_SOURCE_DIR}/cmake/CrtBackend.cmake
  ${PROJECT_SOURCE_DIR}/cmake/crt_backend.map
  DESTINATION ${CRT_INSTALL_CMAKE_DIR})

install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs/ DESTINATION share/doc/crt)
install(FILES ${PROJECT_SOURCE_DIR}/README.md ${PROJECT_SOURCE_DIR}/CHANGELOG.md
  ${PROJECT_SOURCE_DIR}/CONTRIBUTING.md
              ${PROJECT_SOURCE_DIR}/CITATION.cff
  DESTINATION share/doc/crt)
