# The font of all figures becomes part of the library: text looks the same on every machine, whichever fonts it has.
find_file(ESIM_FONT DejaVuSans.ttf PATHS /usr/share/fonts /usr/local/share/fonts
          PATH_SUFFIXES truetype/dejavu dejavu dejavu-sans-fonts TTF truetype NO_CMAKE_FIND_ROOT_PATH)
if(NOT EXISTS "${ESIM_FONT}")
  message(FATAL_ERROR "The font DejaVu Sans, with which esim labels figures and videos, was not found. Install the package "
                      "fonts-dejavu-core (scripts/setup does), or set ESIM_FONT to the path of DejaVuSans.ttf")
endif()
mark_as_advanced(ESIM_FONT)
set_source_files_properties(${CMAKE_CURRENT_SOURCE_DIR}/plot/font_file.S PROPERTIES
  COMPILE_DEFINITIONS "ESIM_FONT=\"${ESIM_FONT}\"" OBJECT_DEPENDS ${ESIM_FONT} SKIP_PRECOMPILE_HEADERS ON)
target_sources(esim_plot PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/plot/font_file.S)
