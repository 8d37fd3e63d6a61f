# Single modules of OpenCV as imported targets opencv_NAME. Debian's OpenCVConfig.cmake is only in the package of
# all of OpenCV, which is an order of magnitude larger than the few modules that esim uses.
#
#   find_package(OpenCVModules REQUIRED COMPONENTS core imgproc ...)
find_path(OpenCVModules_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4)
set(required OpenCVModules_INCLUDE_DIR)
foreach(module IN LISTS OpenCVModules_FIND_COMPONENTS)
  find_library(OpenCVModules_${module}_LIBRARY opencv_${module})
  list(APPEND required OpenCVModules_${module}_LIBRARY)
  if(NOT TARGET opencv_${module} AND OpenCVModules_${module}_LIBRARY)
    add_library(opencv_${module} UNKNOWN IMPORTED)
    set_target_properties(opencv_${module} PROPERTIES
      IMPORTED_LOCATION ${OpenCVModules_${module}_LIBRARY}
      INTERFACE_INCLUDE_DIRECTORIES ${OpenCVModules_INCLUDE_DIR})
  endif()
endforeach()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenCVModules REQUIRED_VARS ${required})
mark_as_advanced(${required})
