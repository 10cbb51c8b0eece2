# The rooms of core/ and plugins/: one folder, one target, and the arrows between them.
#
#   crt_room(<folder> [SOURCES <file>…] [USES <folder>…] [LIBRARIES <target>…]
#            [HEADERS <file>…] [COLD <file>…|ALL])
#
# makes the static library crt_<folder> (a '/' becomes '_') of a folder below the one that calls, or an
# interface library where it has headers alone, which are then compiled once for themselves. HEADERS are
# further ones that it shows, named as from there.
# COLD: files in which nothing takes time; they are compiled for size. Its headers are included as
# "<folder>/<name>.h". Each room has its own include root, build/rooms/<target>, which holds links to
# its headers and to nothing else: a file sees the headers of the rooms that its own room USES, and of those
# that these use. So an include against the arrows does not compile. tests/rooms/check_rooms.py draws the
# arrows, and fails when there is a cycle.

set_property(GLOBAL PROPERTY CRT_ROOMS "")

# build/rooms/<target>/<folder>/<name>.h → <folder>/<name>.h, for every header of the room.
function(_crt_link_headers target folder)
  set(root ${PROJECT_BINARY_DIR}/rooms/${target})
  file(GLOB headers CONFIGURE_DEPENDS RELATIVE ${CMAKE_CURRENT_SOURCE_DIR}
    ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*.h)
  list(APPEND headers ${ARGN})
  foreach(header IN LISTS headers)
    if(NOT EXISTS ${root}/${header})
      get_filename_component(directory ${root}/${header} DIRECTORY)
      file(MAKE_DIRECTORY ${directory})
      file(CREATE_LINK ${CMAKE_CURRENT_SOURCE_DIR}/${header} ${root}/${header} SYMBOLIC)
    endif()
  endforeach()
  file(GLOB_RECURSE there RELATIVE ${root} ${root}/*.h)
  list(REMOVE_ITEM there ${headers})
  foreach(gone IN LISTS there)
    file(REMOVE ${root}/${gone})
  endforeach()
endfunction()

# The cold files of a room, compiled for size. They are a separate target, so that several of them can be
# compiled at a time, too.
function(_crt_cold_part target folder)
  list(TRANSFORM ARGN PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/)
  add_library(${target}_cold OBJECT ${ARGN})
  target_compile_options(${target}_cold PRIVATE $<$<CONFIG:Release>:-Os>)
  target_link_libraries(${target}_cold PRIVATE crt_flags)
  foreach(part IN ITEMS INCLUDE_DIRECTORIES COMPILE_DEFINITIONS)
    set_property(TARGET ${target}_cold APPEND PROPERTY ${part} $<TARGET_PROPERTY:${target},${part}>)
  endforeach()
  target_sources(${target} PRIVATE $<TARGET_OBJECTS:${target}_cold>)
endfunction()

# Compiles the headers of a room that has nothing else, with no other include roots than those it sees.
function(_crt_compile_headers target folder)
  file(GLOB headers CONFIGURE_DEPENDS RELATIVE ${CMAKE_CURRENT_SOURCE_DIR}
    ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*.h)
  list(TRANSFORM headers REPLACE "(.+)" "#include \"\\1\"\n")
  list(JOIN headers "" text)
  set(file ${PROJECT_BINARY_DIR}/generated/rooms/${target}_headers.cpp)
  file(CONFIGURE OUTPUT ${file} CONTENT "${text}" @ONLY)
  add_library(${target}_headers OBJECT ${file})
  target_compile_options(${target}_headers PRIVATE $<$<CONFIG:Release>:-O0>)
  target_include_directories(${target}_headers PRIVATE ${PROJECT_BINARY_DIR}/generated)  # the layout hash
  target_link_libraries(${target}_headers PRIVATE ${target} crt_flags)
endfunction()

function(crt_room folder)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;USES;LIBRARIES;HEADERS;COLD")
  string(REPLACE "/" "_" name ${folder})
  set(target crt_${name})
  _crt_link_headers(${target} ${folder} ${arg_HEADERS})
  set(used "")
  foreach(room IN LISTS arg_USES)
    string(REPLACE "/" "_" room ${room})
    if(NOT TARGET crt_${room})
      message(FATAL_ERROR "${folder} uses ${room}, which is no room, or one that comes later")
    endif()
    list(APPEND used crt_${room})
  endforeach()
  if(arg_SOURCES)
    if(NOT arg_COLD STREQUAL "ALL")
      list(REMOVE_ITEM arg_SOURCES ${arg_COLD})
    endif()
    list(TRANSFORM arg_SOURCES PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/${folder}/)
    add_library(${target} STATIC ${arg_SOURCES})
    target_include_directories(${target} PUBLIC ${PROJECT_BINARY_DIR}/rooms/${target})
    target_link_libraries(${target} PUBLIC ${used} ${arg_LIBRARIES} PRIVATE crt_flags)
    if(arg_COLD STREQUAL "ALL")
      target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-Os>)
    elseif(arg_COLD)
      _crt_cold_part(${target} ${folder} ${arg_COLD})
    endif()
  else()
    add_library(${target} INTERFACE)
    target_include_directories(${target} INTERFACE ${PROJECT_BINARY_DIR}/rooms/${target})
    target_link_libraries(${target} INTERFACE ${used} ${arg_LIBRARIES})
    _crt_compile_headers(${target} ${folder})
  endif()
  set_property(GLOBAL APPEND PROPERTY CRT_ROOMS ${target})
endfunction()
