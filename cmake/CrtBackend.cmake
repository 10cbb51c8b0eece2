# crt_add_backend: one function for the plugins of this tree and, through find_package(crt), for everybody
# else's.
#
#   crt_add_backend(<name> SOURCES <file>… [OUTPUT_DIRECTORY <dir>] [NO_INSTALL])
#
# Makes the target crt_backend_<name>, a module crt_backend_<name>.so that
#   - exports crt_backend_v1 and nothing else,
#   - links nothing of crt but the headers (an undefined symbol is an error now, not when crt loads it),
#   - is compiled without contraction, so that it rounds as every other backend does,
#   - finds libraries shipped beside it or one folder up, wherever the tree is moved to.
# It is built into OUTPUT_DIRECTORY (default: ${CRT_BACKEND_OUTPUT_DIRECTORY} where set) and installed to
# lib/crt.
# Link further libraries to the target as usual; crt::kernel_cache is a disk cache for compiled kernels.

set(_CRT_BACKEND_MAP ${CMAKE_CURRENT_LIST_DIR}/crt_backend.map)

function(crt_add_backend name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "NO_INSTALL" "OUTPUT_DIRECTORY" "SOURCES")
  if(NOT name MATCHES "^[a-z][a-z0-9_]*$")
    message(FATAL_ERROR
      "crt_add_backend: '${name}' is not a backend name: lower-case letters, digits and '_' only")
  endif()
  if(NOT arg_SOURCES)
    message(FATAL_ERROR "crt_add_backend(${name}): no SOURCES given")
  endif()
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "crt_add_backend(${name}): unknown arguments: ${arg_UNPARSED_ARGUMENTS}")
  endif()

  set(target crt_backend_${name})
  add_library(${target} MODULE ${arg_SOURCES})
  target_link_libraries(${target} PRIVATE crt::backend_headers)
  if(TARGET crt_flags)
    target_link_libraries(${target} PRIVATE crt_flags)
  endif()
  target_compile_features(${target} PRIVATE cxx_std_17)
  target_compile_options(${target} PRIVATE
    $<$<COMPILE_LANGUAGE:C,CXX>:-ffp-contract=off>
    $<$<COMPILE_LANGUAGE:CUDA>:--fmad=false>)
  target_link_options(${target} PRIVATE -Wl,--version-script=${_CRT_BACKEND_MAP})
  if(NOT CMAKE_CXX_FLAGS MATCHES "-fsanitize")  # a sanitizer's run-time symbols come from the program
    target_link_options(${target} PRIVATE -Wl,-z,defs)
  endif()
  set_target_properties(${target} PROPERTIES
    PREFIX ""
    SUFFIX .so
    CXX_EXTENSIONS OFF
    C_VISIBILITY_PRESET hidden
    CXX_VISIBILITY_PRESET hidden
    VISIBILITY_INLINES_HIDDEN ON
    LINK_DEPENDS ${_CRT_BACKEND_MAP}
    INSTALL_RPATH "$ORIGIN;$ORIGIN/.."
    # Else CMake pads the path of the build tree with ':', and the loader searches the current folder.
    BUILD_WITH_INSTALL_RPATH ON
    # Libraries outside the system's directories (the CUDA toolkit's) are still found once installed.
    INSTALL_RPATH_USE_LINK_PATH ON)

  if(arg_OUTPUT_DIRECTORY)
    set_target_properties(${target} PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${arg_OUTPUT_DIRECTORY})
  elseif(CRT_BACKEND_OUTPUT_DIRECTORY)
    set_target_properties(${target} PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${CRT_BACKEND_OUTPUT_DIRECTORY})
  endif()
  if(NOT arg_NO_INSTALL)
    install(TARGETS ${target} LIBRARY DESTINATION lib/crt)
  endif()
endfunction()
