# For the wheel, as CMAKE_PROJECT_esim_INCLUDE: links to static libraries where this saves size or dependencies.
# ESIM_WHEEL_LIBRARIES is the folder that packaging/build-libraries has filled.
list(PREPEND CMAKE_MODULE_PATH ${CMAKE_CURRENT_LIST_DIR})

set(archives /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE})
foreach(module core imgproc video)
  set(OpenCVModules_${module}_LIBRARY ${archives}/libopencv_${module}.a CACHE FILEPATH "" FORCE)
endforeach()
set(Cairo_LIBRARY ${ESIM_WHEEL_LIBRARIES}/lib/libcairo.a CACHE FILEPATH "" FORCE)
set(Cairo_INCLUDE_DIR ${ESIM_WHEEL_LIBRARIES}/include/cairo CACHE PATH "" FORCE)

add_library(esim_opencv_without OBJECT ${CMAKE_CURRENT_LIST_DIR}/opencv_without.cpp)
set_target_properties(esim_opencv_without PROPERTIES POSITION_INDEPENDENT_CODE ON)
add_link_options(-s -Wl,--gc-sections,--as-needed,--exclude-libs,ALL)

# What the static libraries need in turn.
function(esim_link_static)
  foreach(program esim_app esim_python)
    target_link_libraries(${program} PRIVATE esim_opencv_without)
  endforeach()
  target_link_libraries(opencv_core INTERFACE TBB::tbb ZLIB::ZLIB ${CMAKE_DL_LIBS})
  target_link_libraries(opencv_imgproc INTERFACE opencv_core)
  target_link_libraries(opencv_video INTERFACE opencv_imgproc)
  target_link_libraries(Cairo::Cairo INTERFACE pixman-1 PNG::PNG)
endfunction()
cmake_language(DEFER CALL esim_link_static)
