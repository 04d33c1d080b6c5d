# The Debian package, by CPack: `./run package` configures with SPARFLOW_PACKAGE, builds, and tries the package in a clean root.
# It holds what `cmake --install` does (program, library, bundled data, Python module) and besides manual pages,
# completion for three shells, guides and examples.
if(NOT SPARFLOW_PACKAGE)
  return()
endif()

set(GENERATED ${CMAKE_BINARY_DIR}/package)
set(DOCUMENTS ${CMAKE_INSTALL_DATADIR}/doc/sparflow)

# What the program says of itself is asked of the program that was built.
add_custom_target(package_files ALL
  COMMAND sh ${CMAKE_SOURCE_DIR}/cmake/package/man_pages.sh $<TARGET_FILE:sparflow> ${PROJECT_VERSION} ${GENERATED}/man
  COMMAND sh -c "$<TARGET_FILE:sparflow> completion bash >${GENERATED}/sparflow.bash"
  COMMAND sh -c "$<TARGET_FILE:sparflow> completion zsh >${GENERATED}/_sparflow"
  COMMAND sh -c "$<TARGET_FILE:sparflow> completion fish >${GENERATED}/sparflow.fish"
  COMMAND sh -c "gzip -9nc ${CMAKE_SOURCE_DIR}/CHANGELOG.md >${GENERATED}/changelog.gz"
  COMMENT "manual pages and completion" VERBATIM)
add_dependencies(package_files sparflow)

install(DIRECTORY ${GENERATED}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
install(FILES ${GENERATED}/sparflow.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME sparflow)
install(FILES ${GENERATED}/_sparflow DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions)
install(FILES ${GENERATED}/sparflow.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
install(FILES ${GENERATED}/changelog.gz ${CMAKE_SOURCE_DIR}/cmake/package/copyright ${CMAKE_SOURCE_DIR}/README.md
        DESTINATION ${DOCUMENTS})
install(DIRECTORY ${CMAKE_SOURCE_DIR}/docs DESTINATION ${DOCUMENTS} PATTERN history EXCLUDE)
install(DIRECTORY ${CMAKE_SOURCE_DIR}/examples DESTINATION ${DOCUMENTS} PATTERN CMakeLists.txt EXCLUDE)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME sparflow)
set(CPACK_PACKAGE_CONTACT "The Sparflow authors <sparflow@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "models and energy-optimal motions of load-sensing hydraulic machines")
set(CPACK_PACKAGE_DESCRIPTION
"Sparflow identifies the working pressures of cranes and excavators from their logs,
finds which physical effect a model lacks, adds it, and computes energy-optimal
motions. This package holds the program, its static library with headers
(find_package(sparflow)), the Python module, manual pages, completion for shells,
bundled machines and examples.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
# The module is compiled for one minor version of Python.
math(EXPR NEXT_MINOR "${Python_VERSION_MINOR} + 1")
set(CPACK_DEBIAN_PACKAGE_DEPENDS
    "python3 (>= 3.${Python_VERSION_MINOR}), python3 (<< 3.${NEXT_MINOR}), python3-numpy")
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "python3-pandas, python3-matplotlib")
# What a project needs that is built against the library: the development packages of packages.txt.
file(STRINGS ${CMAKE_SOURCE_DIR}/packages.txt LINES)
set(SECTION "")
set(DEVELOPMENT g++ cmake)
foreach(LINE ${LINES})
  string(REGEX REPLACE "[ \t]*#.*" "" LINE "${LINE}")
  if(LINE MATCHES "^\\[(.*)\\]$")
    set(SECTION ${CMAKE_MATCH_1})
  elseif(SECTION STREQUAL "program" AND LINE MATCHES "-dev$|pkg-config")
    list(APPEND DEVELOPMENT ${LINE})
  endif()
endforeach()
list(JOIN DEVELOPMENT ", " DEVELOPMENT)
string(APPEND CPACK_DEBIAN_PACKAGE_SUGGESTS ", ${DEVELOPMENT}")
include(CPack)
