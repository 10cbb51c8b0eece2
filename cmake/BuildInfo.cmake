# generated/build_info.h: the commit that a program was built from, for reports. Looked up at every build,
# written only when it changed.
#
# Included, it adds the target `crt_build_info`; run as a script (cmake -P), it writes the header.
if(CMAKE_SCRIPT_MODE_FILE)
  execute_process(COMMAND git -C ${SOURCE_DIR} rev-parse --short=12 HEAD OUTPUT_VARIABLE commit ERROR_QUIET
    OUTPUT_STRIP_TRAILING_WHITESPACE)
  execute_process(COMMAND git -C ${SOURCE_DIR} status --porcelain --untracked-files=no OUTPUT_VARIABLE
    changes ERROR_QUIET)
  if(NOT commit)
    set(commit unknown)
  endif()
  if(changes)
    set(dirty 1)
  else()
    set(dirty 0)
  endif()
  string(CONCAT text "#define CRT_COMMIT \"${commit}\"\n#define CRT_COMMIT_DIRTY ${dirty}\n"
                     "#define CRT_COMPILER \"${COMPILER}\"\n#define CRT_COMPILER_FLAGS \"${FLAGS}\"\n")
  set(before "")
  if(EXISTS ${HEADER})
    file(READ ${HEADER} before)
  endif()
  if(NOT text STREQUAL before)
    file(WRITE ${HEADER} "${text}")
  endif()
  return()
endif()

string(TOUPPER "${CMAKE_BUILD_TYPE}" type)
string(STRIP "${CMAKE_CXX_FLAGS} ${CMAKE_CXX_FLAGS_${type}} -ffp-contract=off" flags)
add_custom_target(crt_build_info
  COMMAND ${CMAKE_COMMAND} -DSOURCE_DIR=${PROJECT_SOURCE_DIR}
  -DHEADER=${PROJECT_BINARY_DIR}/generated/build_info.h
          "-DCOMPILER=${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}" "-DFLAGS=${flags}" -P
          ${CMAKE_CURRENT_LIST_FILE}
  BYPRODUCTS ${PROJECT_BINARY_DIR}/generated/build_info.h
  VERBATIM)
