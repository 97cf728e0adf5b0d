# Versions below 1.0 are compatible with the same minor version only.
set(PACKAGE_VERSION "@VERSION@")
string(REGEX MATCH "^[0-9]+\\.[0-9]+" _gyrfalcon_own "${PACKAGE_VERSION}")
string(REGEX MATCH "^[0-9]+\\.[0-9]+" _gyrfalcon_asked "${PACKAGE_FIND_VERSION}")
if("${PACKAGE_FIND_VERSION}" VERSION_LESS_EQUAL "${PACKAGE_VERSION}" AND
   ("${_gyrfalcon_asked}" STREQUAL "" OR "${_gyrfalcon_asked}" STREQUAL "${_gyrfalcon_own}"))
  set(PACKAGE_VERSION_COMPATIBLE TRUE)
endif()
if("${PACKAGE_FIND_VERSION}" STREQUAL "${PACKAGE_VERSION}")
  set(PACKAGE_VERSION_EXACT TRUE)
endif()
