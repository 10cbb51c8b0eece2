# For scripts (cmake -P).

# Runs a command, in the folder RUN_FOLDER if that is set, and stops if it does not end well. `output` is
# what it wrote, messages included.
function(run)
  if(NOT DEFINED RUN_FOLDER)
    set(RUN_FOLDER ${CMAKE_CURRENT_BINARY_DIR})
  endif()
  execute_process(COMMAND ${ARGV} WORKING_DIRECTORY ${RUN_FOLDER}
    RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    string(JOIN " " command ${ARGV})
    message(FATAL_ERROR "${command}\nended with ${result}:\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()
