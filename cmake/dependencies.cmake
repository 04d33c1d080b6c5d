# Third-party libraries, Debian 12 packages only (packages.txt). Odd ones get a small wrapper target here.
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED)
find_package(fmt REQUIRED)
find_package(spdlog REQUIRED)
find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(yaml-cpp REQUIRED)
pkg_check_modules(IPOPT REQUIRED IMPORTED_TARGET GLOBAL ipopt)  # carries -DHAVE_CSTDDEF

# OMPL's package file names no target and boost libraries that are not installed: link libompl itself.
find_path(OMPL_INCLUDE ompl/config.h PATHS /usr/include/ompl-1.5 REQUIRED)
find_library(OMPL_LIBRARY ompl REQUIRED)
add_library(sparflow_ompl INTERFACE)
target_include_directories(sparflow_ompl SYSTEM INTERFACE ${OMPL_INCLUDE})
target_link_libraries(sparflow_ompl INTERFACE ${OMPL_LIBRARY})
# libompl brings its own, older Eigen: see the file.
target_link_options(sparflow_ompl INTERFACE
  "$<BUILD_INTERFACE:LINKER:--version-script=${CMAKE_SOURCE_DIR}/cmake/keep_eigen_private.map>"
  "$<INSTALL_INTERFACE:LINKER:--version-script=$<INSTALL_PREFIX>/lib/cmake/sparflow/keep_eigen_private.map>")

find_path(MATIO_INCLUDE matio.h REQUIRED)
find_library(MATIO_LIBRARY matio REQUIRED)
add_library(sparflow_matio INTERFACE)
target_include_directories(sparflow_matio SYSTEM INTERFACE ${MATIO_INCLUDE})
target_link_libraries(sparflow_matio INTERFACE ${MATIO_LIBRARY})

pkg_check_modules(URDFDOM REQUIRED IMPORTED_TARGET GLOBAL urdfdom)
add_library(sparflow_urdf INTERFACE)
target_link_libraries(sparflow_urdf INTERFACE PkgConfig::URDFDOM)
