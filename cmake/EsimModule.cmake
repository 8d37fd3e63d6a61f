# esim_module(NAME [UNITY] [DEPENDS other modules] [PUBLIC libraries] [PRIVATE libraries])
#
# A folder of src/esim as a static library, esim::NAME, of all .cpp files in it. A module links only to the modules that
# it depends on, so an include that ARCHITECTURE.md does not allow fails to link (and tests/architecture_test.py reports
# it).
#
# UNITY compiles several .cpp files at once, which takes half the time where they include the same heavy headers. It is
# not for folders that compute with floating-point numbers: what the compiler contracts into one instruction could then
# depend on which files are compiled together, and with it the last bit of an event's time. Builds with sanitizers, which
# only tests use, compile all folders so.
set(ESIM_UNITY ON CACHE STRING "Compile several files of a folder at once: ON, OFF, or ALL folders")
function(esim_unity target)
  if(NOT ESIM_UNITY)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 10)
  # In a unit of several files, GCC takes the types in their unnamed namespaces for those of a header.
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    target_compile_options(${target} PRIVATE -Wno-subobject-linkage)
  endif()
endfunction()

function(esim_module name)
  cmake_parse_arguments(ARG "UNITY" "" "DEPENDS;PUBLIC;PRIVATE" ${ARGN})
  string(REPLACE "/" "_" target ${name})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/${name}/*.cpp)
  add_library(esim_${target} STATIC ${sources})
  add_library(esim::${target} ALIAS esim_${target})
  list(TRANSFORM ARG_DEPENDS PREPEND esim_)
  target_include_directories(esim_${target} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src> $<INSTALL_INTERFACE:include>)
  target_compile_features(esim_${target} PUBLIC cxx_std_20)
  # Eigen's alignment must not follow -march, which users of the installed libraries choose for themselves.
  target_compile_definitions(esim_${target} PUBLIC EIGEN_MAX_STATIC_ALIGN_BYTES=16)
  target_link_libraries(esim_${target} PUBLIC ${ARG_DEPENDS} ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE} fmt::fmt esim_build_flags)
  set_target_properties(esim_${target} PROPERTIES EXPORT_NAME ${target} POSITION_INDEPENDENT_CODE ON)
  esim_precompile(esim_${target} esim_precompiled)
  if(ARG_UNITY OR ESIM_UNITY STREQUAL "ALL")
    esim_unity(esim_${target})
  endif()
  set_property(GLOBAL APPEND PROPERTY ESIM_TARGETS esim_${target})
endfunction()
