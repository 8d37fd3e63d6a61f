# esim_add_commit(TARGET) adds the function source_commit() to a library: the commit of the sources, which is determined at
# every build. Also the script that writes it, run as: cmake -D SOURCE=... -D OUT=... -P EsimCommit.cmake
function(esim_add_commit target)
  set(file ${PROJECT_BINARY_DIR}/source_commit.cpp)
  add_custom_target(esim_source_commit BYPRODUCTS ${file} COMMENT ""
    COMMAND ${CMAKE_COMMAND} -D SOURCE=${PROJECT_SOURCE_DIR} -D OUT=${file} -P ${PROJECT_SOURCE_DIR}/cmake/EsimCommit.cmake)
  target_sources(${target} PRIVATE ${file})
  set_source_files_properties(${file} TARGET_DIRECTORY ${target} PROPERTIES GENERATED ON SKIP_UNITY_BUILD_INCLUSION ON)
  add_dependencies(${target} esim_source_commit)
endfunction()

if(NOT CMAKE_SCRIPT_MODE_FILE)
  return()
endif()

set(commit unknown)
file(STRINGS ${SOURCE}/cmake/commit.txt archived LIMIT_COUNT 1)
if(archived MATCHES "^[0-9a-f]+$")
  set(commit ${archived})
else()
  # Not of another repository that contains this folder.
  execute_process(COMMAND git -C ${SOURCE} rev-parse --show-toplevel OUTPUT_VARIABLE top RESULT_VARIABLE failed
    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  file(REAL_PATH ${SOURCE} real_source)
  if(NOT failed AND top STREQUAL real_source)
    execute_process(COMMAND git --no-optional-locks -C ${SOURCE} describe --always --dirty --abbrev=40 --exclude=*
      OUTPUT_VARIABLE described RESULT_VARIABLE failed OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    if(NOT failed)
      set(commit ${described})
    endif()
  endif()
endif()
set(text "// Written by cmake/EsimCommit.cmake.
#include \"esim/compose/provenance.h\"

std::string_view esim::compose::source_commit() { return \"${commit}\"; }
")
file(CONFIGURE OUTPUT ${OUT} CONTENT "${text}" @ONLY)  # only if it has changed
