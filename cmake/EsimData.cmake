# esim_install_data(FOLDER ...) installs the scenes that need no Blender, the documentation as Markdown, and the studio's page if scripts/studio has
# built it.
function(esim_install_data folder)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/scenes DESTINATION ${folder} ${ARGN}
          PATTERN "*.py" EXCLUDE PATTERN "*.blend" EXCLUDE PATTERN "studio_room.yaml" EXCLUDE PATTERN "meshing" EXCLUDE
          PATTERN "__pycache__" EXCLUDE)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs DESTINATION ${folder} ${ARGN}
          PATTERN "*.py" EXCLUDE PATTERN "Doxyfile" EXCLUDE PATTERN "docs/site" EXCLUDE PATTERN "__pycache__" EXCLUDE)
  install(FILES ${PROJECT_SOURCE_DIR}/README.md ${PROJECT_SOURCE_DIR}/ARCHITECTURE.md DESTINATION ${folder} ${ARGN})  # which the pages link to
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/studio/dist/ DESTINATION ${folder}/studio ${ARGN} OPTIONAL)
endfunction()
