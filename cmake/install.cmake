# cmake --install: library, headers, data and program, found by find_package(sparflow).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(EXPORTED sparflow_ompl sparflow_matio sparflow_urdf)
set(INSTALLED_ROOMS)
foreach(ROOM models identification diagnosis problems planners nlp optimizer report)
  if(TARGET sparflow_${ROOM})
    list(APPEND INSTALLED_ROOMS ${ROOM})
    list(APPEND EXPORTED sparflow_${ROOM})
  endif()
endforeach()
foreach(WRAPPER ompl matio urdf)
  set_target_properties(sparflow_${WRAPPER} PROPERTIES EXPORT_NAME ${WRAPPER})
endforeach()
install(TARGETS ${EXPORTED} EXPORT sparflow ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
if(TARGET sparflow)
  install(TARGETS sparflow RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()

set(PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/sparflow)
install(EXPORT sparflow NAMESPACE sparflow:: FILE sparflowTargets.cmake DESTINATION ${PACKAGE_DIR})
configure_package_config_file(${CMAKE_SOURCE_DIR}/cmake/sparflowConfig.cmake.in
                              ${CMAKE_BINARY_DIR}/sparflowConfig.cmake
                              INSTALL_DESTINATION ${PACKAGE_DIR} PATH_VARS CMAKE_INSTALL_DATADIR)
install(FILES ${CMAKE_SOURCE_DIR}/cmake/keep_eigen_private.map DESTINATION lib/cmake/sparflow)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/sparflowConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/sparflowConfig.cmake
              ${CMAKE_BINARY_DIR}/sparflowConfigVersion.cmake DESTINATION ${PACKAGE_DIR})

foreach(ROOM models identification diagnosis problems planners optimizer)
  install(DIRECTORY ${CMAKE_SOURCE_DIR}/${ROOM} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/sparflow
          FILES_MATCHING PATTERN "*.h")
endforeach()
install(DIRECTORY ${CMAKE_SOURCE_DIR}/apps/report
        DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/sparflow/apps FILES_MATCHING PATTERN "*.h"
        PATTERN assets EXCLUDE)
foreach(DATA machines models reaches logs effects)
  install(DIRECTORY ${CMAKE_SOURCE_DIR}/problems/${DATA} DESTINATION ${CMAKE_INSTALL_DATADIR}/sparflow)
endforeach()
install(FILES ${CMAKE_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/sparflow)
