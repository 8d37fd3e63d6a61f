# Installs the program, the libraries with their headers, and the files for find_package(esim).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

get_property(targets GLOBAL PROPERTY ESIM_TARGETS)
install(TARGETS esim_app RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
install(TARGETS ${targets} esim_build_flags EXPORT esimTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/src/esim DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")
esim_install_data(${CMAKE_INSTALL_DATADIR}/esim COMPONENT program)
# The documentation as a site, if scripts/docs has built it; too large for a wheel.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/build/site/${PROJECT_VERSION}/ DESTINATION ${CMAKE_INSTALL_DATADIR}/esim/site COMPONENT program OPTIONAL)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/esim)
install(EXPORT esimTargets NAMESPACE esim:: DESTINATION ${package_dir})
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/esimConfig.cmake.in ${PROJECT_BINARY_DIR}/esimConfig.cmake
                              INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/esimConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/esimConfig.cmake ${PROJECT_BINARY_DIR}/esimConfigVersion.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindOpenCVModules.cmake ${PROJECT_SOURCE_DIR}/cmake/FindFFmpegLibraries.cmake ${PROJECT_SOURCE_DIR}/cmake/FindEpoxy.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindCairo.cmake ${PROJECT_SOURCE_DIR}/cmake/FindISAL.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindLZ4.cmake ${PROJECT_SOURCE_DIR}/cmake/FindZstd.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindLibZip.cmake ${PROJECT_SOURCE_DIR}/cmake/FindWebP.cmake ${PROJECT_SOURCE_DIR}/cmake/FindBlosc.cmake
              ${PROJECT_SOURCE_DIR}/cmake/EsimDependencies.cmake
        DESTINATION ${package_dir})
