# esim_module(NAME SOURCES a.cpp ... [DEPENDS other modules] [PUBLIC libraries] [PRIVATE libraries])
#
# Each folder of src/esim is a static library, esim::NAME. A module links only to the modules that it depends
# on, so that an include against the arrows of ARCHITECTURE.md fails to link
# (and tests/architecture_test.py reports it).
function(esim_module name)
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS;PUBLIC;PRIVATE" ${ARGN})
  string(REPLACE "/" "_" target ${name})
  add_library(esim_${target} STATIC ${ARG_SOURCES})
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
  set_property(GLOBAL APPEND PROPERTY ESIM_TARGETS esim_${target})
endfunction()
