# find_package(gyrfalcon) defines the target gyrfalcon::gyrfalcon.
get_filename_component(_gyrfalcon_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
if(NOT TARGET gyrfalcon::gyrfalcon)
  add_library(gyrfalcon::gyrfalcon STATIC IMPORTED)
  set_target_properties(gyrfalcon::gyrfalcon PROPERTIES
    IMPORTED_LOCATION "${_gyrfalcon_prefix}/lib/libgyrfalcon.a"
    INTERFACE_INCLUDE_DIRECTORIES "${_gyrfalcon_prefix}/include")
endif()
unset(_gyrfalcon_prefix)
