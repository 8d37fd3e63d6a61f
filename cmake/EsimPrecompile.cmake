# Headers that most sources include, compiled once. Sources include what they use all the same: builds with
# ESIM_PRECOMPILE=OFF, such as the one for fuzzing, fail otherwise.
option(ESIM_PRECOMPILE "Compile common headers once" ON)

set(esim_common_headers <algorithm> <array> <chrono> <cmath> <cstdint> <filesystem> <fstream> <functional> <limits> <map>
                        <memory> <mutex> <numeric> <optional> <set> <span> <string> <string_view> <thread> <utility> <variant> <vector>)

# A target without sources of its own, whose headers other targets use: they must be compiled with the same options.
function(esim_add_precompiled name)
  cmake_parse_arguments(ARG "" "" "HEADERS;LIBRARIES" ${ARGN})
  if(NOT ESIM_PRECOMPILE)
    return()
  endif()
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/${name}.cpp CONTENT "")
  add_library(${name} OBJECT ${PROJECT_BINARY_DIR}/${name}.cpp)
  target_compile_features(${name} PRIVATE cxx_std_20)
  target_compile_definitions(${name} PRIVATE EIGEN_MAX_STATIC_ALIGN_BYTES=16)
  target_link_libraries(${name} PRIVATE ${ARG_LIBRARIES} esim_build_flags)
  target_precompile_headers(${name} PRIVATE ${esim_common_headers} ${ARG_HEADERS})
endfunction()

function(esim_precompile target from)
  if(ESIM_PRECOMPILE)
    target_precompile_headers(${target} REUSE_FROM ${from})
  endif()
endfunction()

if(CMAKE_CXX_COMPILER_LAUNCHER MATCHES "ccache")
  add_compile_options(-fpch-preprocess)  # with CCACHE_SLOPPINESS=pch_defines,time_macros
endif()
esim_add_precompiled(esim_precompiled HEADERS <Eigen/Geometry> <fmt/format.h> LIBRARIES Eigen3::Eigen fmt::fmt)
if(TARGET esim_precompiled)
  set_target_properties(esim_precompiled PROPERTIES POSITION_INDEPENDENT_CODE ON)
endif()
