# The layout hash: one number for "reads the scene blob the same way".
#
# A plugin reads the compiled scene as C structs, so core and plugin must have been built with the same
# layout.h, channels.h and features.h of kernel/dialect. Their texts are hashed (SHA-256, first 64 bits) into
# a header that both sides compile in; the loader refuses a plugin that has another one. A changed comment
# changes the hash too: rebuilding is cheap, a misread scene is not.
#
# Writes ${CMAKE_BINARY_DIR}/generated/backend/crt_layout_hash.h.

function(crt_write_layout_hash)
  set(text "")
  set(headers kernel/dialect/layout.h kernel/dialect/channels.h kernel/dialect/features.h)
  list(JOIN headers "\", \"" CRT_LAYOUT_HEADER_NAMES)
  foreach(header ${headers})
    set(path ${PROJECT_SOURCE_DIR}/core/${header})
    file(READ ${path} header_text)
    string(APPEND text "${header_text}")
    set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${path})
  endforeach()
  string(SHA256 digest "${text}")
  string(SUBSTRING ${digest} 0 16 CRT_LAYOUT_HASH_DIGITS)
  # Leaves the file alone when nothing changed, so that a configure run alone rebuilds nothing.
  configure_file(${PROJECT_SOURCE_DIR}/cmake/crt_layout_hash.h.in
                 ${PROJECT_BINARY_DIR}/generated/backend/crt_layout_hash.h @ONLY)
endfunction()

crt_write_layout_hash()
