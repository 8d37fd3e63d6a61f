# The tables and structs of AEDAT 4 files, compiled from their schema.
find_program(FLATC_EXECUTABLE flatc REQUIRED)
find_path(FLATBUFFERS_INCLUDE_DIR flatbuffers/flatbuffers.h REQUIRED)
set(generated_dir ${CMAKE_CURRENT_BINARY_DIR}/generated)
add_custom_command(
  OUTPUT ${generated_dir}/aedat4_generated.h
  COMMAND ${FLATC_EXECUTABLE} --cpp --scoped-enums -o ${generated_dir} ${CMAKE_CURRENT_LIST_DIR}/aedat4.fbs
  DEPENDS ${CMAKE_CURRENT_LIST_DIR}/aedat4.fbs VERBATIM)
# A target of its own, so that the header can be made without the libraries on which esim_formats depends.
add_custom_target(esim_aedat4_schema DEPENDS ${generated_dir}/aedat4_generated.h)
add_dependencies(esim_formats esim_aedat4_schema)
target_include_directories(esim_formats SYSTEM PRIVATE ${generated_dir} ${FLATBUFFERS_INCLUDE_DIR})
