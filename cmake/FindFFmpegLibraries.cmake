# FFmpeg's libraries as imported targets ffmpeg_NAME.
#
#   find_package(FFmpegLibraries REQUIRED COMPONENTS avcodec avformat ...)
find_path(FFmpegLibraries_INCLUDE_DIR libavcodec/avcodec.h)
set(required FFmpegLibraries_INCLUDE_DIR)
foreach(library IN LISTS FFmpegLibraries_FIND_COMPONENTS)
  find_library(FFmpegLibraries_${library}_LIBRARY ${library})
  list(APPEND required FFmpegLibraries_${library}_LIBRARY)
  if(NOT TARGET ffmpeg_${library} AND FFmpegLibraries_${library}_LIBRARY)
    add_library(ffmpeg_${library} UNKNOWN IMPORTED)
    set_target_properties(ffmpeg_${library} PROPERTIES
      IMPORTED_LOCATION ${FFmpegLibraries_${library}_LIBRARY}
      INTERFACE_INCLUDE_DIRECTORIES ${FFmpegLibraries_INCLUDE_DIR})
  endif()
endforeach()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(FFmpegLibraries REQUIRED_VARS ${required})
mark_as_advanced(${required})
