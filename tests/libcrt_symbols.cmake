# libcrt exports its interface and nothing else: no symbol of the rooms, whose names a program or another
# library may have too.
#
#   cmake -DNM=… -DLIBRARY=… -P libcrt_symbols.cmake
execute_process(COMMAND ${NM} -D --defined-only --demangle ${LIBRARY} OUTPUT_VARIABLE output RESULT_VARIABLE
  result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "${NM} cannot read ${LIBRARY}")
endif()
string(REGEX MATCHALL "[^\n]+" lines "${output}")
foreach(line IN LISTS lines)
  if(line MATCHES "^[0-9a-f]* [A-Za-z] (typeinfo for |typeinfo name for |vtable for )?crt::v0::(.*)$")
    set(found "${found}\n${CMAKE_MATCH_2}")
  elseif(NOT line MATCHES "^[0-9a-f]* [A-Za-z] __(asan|ubsan|tsan|sanitizer|gcov)")
    message(FATAL_ERROR "libcrt exports what is not of its interface: ${line}")
  endif()
endforeach()
if(NOT found MATCHES "\nrender\\(")
  message(FATAL_ERROR "libcrt does not export render():\n${output}")
endif()
