# The targets that a backend links, with the same names in this tree and in an installed one:
#   crt::backend_headers  backend/crt_backend.h, backend/sdk/*.h, the layout hash, kernel/*/*.h,
#                         system/*.h
#   crt::kernel_cache     backend/sdk/kernel_cache.h and compile_process.h and their code, to be linked
#                         into the plugin

include(LayoutHash)
include(CrtBackend)
include(EmbedKernels)

add_library(crt_backend_headers INTERFACE)
add_library(crt::backend_headers ALIAS crt_backend_headers)
target_link_libraries(crt_backend_headers INTERFACE $<BUILD_INTERFACE:crt_backend_sdk>)
target_include_directories(crt_backend_headers INTERFACE
  $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/generated>
  $<INSTALL_INTERFACE:include/crt>)
set_target_properties(crt_backend_headers PROPERTIES EXPORT_NAME backend_headers)

# Uses nothing of the core, and XXH3 by its header alone, so that it can be compiled into any plugin.
add_library(crt_kernel_cache STATIC ${PROJECT_SOURCE_DIR}/core/backend/sdk/kernel_cache.cpp
  ${PROJECT_SOURCE_DIR}/core/backend/sdk/compile_message.cpp
  ${PROJECT_SOURCE_DIR}/core/backend/sdk/compile_process.cpp
  ${PROJECT_SOURCE_DIR}/core/base/code_trust.cpp ${PROJECT_SOURCE_DIR}/core/base/file_cache.cpp)
add_library(crt::kernel_cache ALIAS crt_kernel_cache)
target_include_directories(crt_kernel_cache PRIVATE ${PROJECT_BINARY_DIR}/rooms/crt_base)
target_link_libraries(crt_kernel_cache PUBLIC crt_backend_headers PRIVATE $<BUILD_INTERFACE:crt_flags>)
target_compile_features(crt_kernel_cache PUBLIC cxx_std_17)
set_target_properties(crt_kernel_cache PROPERTIES
  EXPORT_NAME kernel_cache
  POSITION_INDEPENDENT_CODE ON
  CXX_VISIBILITY_PRESET hidden
  VISIBILITY_INLINES_HIDDEN ON)
