# cmake --install: library, headers, data and program, found by find_package(sparflow).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(EXPORTED sparflow_ompl sparflow_matio sparflow_nlopt sparflow_urdf)
set(INSTALLED_ROOMS)
foreach(ROOM models identification diagnosis problems planners nlp optimizer report)
  if(TARGET sparflow_${ROOM})
    list(APPEND INSTALLED_ROOMS ${ROOM})
    list(APPEND EXPORTED sparflow_${ROOM})
  endif()
endforeach()
foreach(WRAPPER ompl matio nlopt urdf)
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

# public headers alone; the others are internal (docs/arrows.txt)
foreach(ROOM models identification diagnosis problems planners optimizer apps/report)
  file(STRINGS ${CMAKE_SOURCE_DIR}/${ROOM}/public_headers.txt HEADERS REGEX "^[^#]")
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/${ROOM}/public_headers.txt)
  foreach(HEADER ${HEADERS})
    get_filename_component(FOLDER ${HEADER} DIRECTORY)
    install(FILES ${CMAKE_SOURCE_DIR}/${HEADER} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/sparflow/${FOLDER})
  endforeach()
endforeach()
foreach(DATA machines models plants reaches scenarios logs effects)
  install(DIRECTORY ${CMAKE_SOURCE_DIR}/problems/${DATA} DESTINATION ${CMAKE_INSTALL_DATADIR}/sparflow)
endforeach()
install(FILES ${CMAKE_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/sparflow)
