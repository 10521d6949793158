# find_package(ftqp CONFIG PATHS <this folder>) gives ftqp::ftqp, the static library with its headers.
get_filename_component(_ftqp "${CMAKE_CURRENT_LIST_DIR}/.." ABSOLUTE)
if(NOT TARGET ftqp::ftqp)
  add_library(ftqp::ftqp STATIC IMPORTED)
  set_target_properties(ftqp::ftqp PROPERTIES
    IMPORTED_LOCATION "${_ftqp}/lib/libftqp.a"
    INTERFACE_INCLUDE_DIRECTORIES "${_ftqp}/include;${_ftqp}"
    INTERFACE_LINK_LIBRARIES m)
endif()
