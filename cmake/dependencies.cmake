# Third-party libraries, Debian 12 packages only (packages.txt). Everything that is missing is said at once, by name and
# with the package that brings it, before anything is compiled: sparflow_require() notes it, sparflow_report_missing()
# stops. Odd libraries get a small wrapper target here.
set(SPARFLOW_MISSING "")

# Notes library LIBRARY of Debian package PACKAGE as missing unless the condition that follows holds.
macro(sparflow_require LIBRARY PACKAGE)
  if(NOT (${ARGN}))
    list(APPEND SPARFLOW_MISSING "${LIBRARY}|${PACKAGE}")
  endif()
endmacro()

# Stops with a list of all that was noted; silent where nothing is missing.
macro(sparflow_report_missing)
  if(SPARFLOW_MISSING)
    set(SPARFLOW_LINES "")
    set(SPARFLOW_PACKAGES "")
    foreach(ENTRY IN LISTS SPARFLOW_MISSING)
      string(REPLACE "|" ";" ENTRY "${ENTRY}")
      list(GET ENTRY 0 LIBRARY)
      list(GET ENTRY 1 PACKAGE)
      string(APPEND SPARFLOW_LINES "  ${LIBRARY}  (Debian package ${PACKAGE})\n")
      string(APPEND SPARFLOW_PACKAGES " ${PACKAGE}")
    endforeach()
    message(FATAL_ERROR "libraries that Sparflow needs are missing:\n${SPARFLOW_LINES}"
                        "On Debian 12: apt-get install --no-install-recommends${SPARFLOW_PACKAGES}\n"
                        "(./run installs what packages.txt lists by itself.)")
  endif()
endmacro()

find_package(PkgConfig QUIET)
sparflow_require("pkg-config" pkg-config PkgConfig_FOUND)
find_package(Threads QUIET)
sparflow_require("POSIX threads" libc6-dev Threads_FOUND)
find_package(Eigen3 3.4 QUIET)
sparflow_require("Eigen 3.4" libeigen3-dev Eigen3_FOUND)
find_package(fmt QUIET)
sparflow_require("fmt" libfmt-dev fmt_FOUND)
find_package(spdlog QUIET)
sparflow_require("spdlog" libspdlog-dev spdlog_FOUND)
find_package(CLI11 QUIET)
sparflow_require("CLI11" libcli11-dev CLI11_FOUND)
find_package(nlohmann_json QUIET)
sparflow_require("nlohmann::json" nlohmann-json3-dev nlohmann_json_FOUND)
find_package(yaml-cpp QUIET)
sparflow_require("yaml-cpp" libyaml-cpp-dev yaml-cpp_FOUND)

# Ipopt's package file names libraries that its Debian package does not depend on: each is looked for by itself.
set(SPARFLOW_PACKAGE_OF_lapack liblapack-dev)
set(SPARFLOW_PACKAGE_OF_blas libblas-dev)
set(SPARFLOW_PACKAGE_OF_dmumps_seq libmumps-seq-dev)
set(SPARFLOW_PACKAGE_OF_gfortran libgfortran-12-dev)
set(SPARFLOW_PACKAGE_OF_quadmath libgfortran-12-dev)
set(SPARFLOW_PACKAGE_OF_m libc6-dev)
set(SPARFLOW_PACKAGE_OF_dl libc6-dev)
if(PkgConfig_FOUND)
  pkg_check_modules(IPOPT QUIET IMPORTED_TARGET GLOBAL ipopt)  # carries -DHAVE_CSTDDEF
  sparflow_require("Ipopt" coinor-libipopt-dev IPOPT_FOUND)
  foreach(LIBRARY IN LISTS IPOPT_LIBRARIES)
    find_library(SPARFLOW_LIBRARY_${LIBRARY} ${LIBRARY} HINTS ${IPOPT_LIBRARY_DIRS} ${CMAKE_CXX_IMPLICIT_LINK_DIRECTORIES})
    mark_as_advanced(SPARFLOW_LIBRARY_${LIBRARY})
    set(PACKAGE "${SPARFLOW_PACKAGE_OF_${LIBRARY}}")
    if(NOT PACKAGE)
      set(PACKAGE "lib${LIBRARY}-dev")
    endif()
    sparflow_require("lib${LIBRARY}, which Ipopt is linked with" ${PACKAGE} SPARFLOW_LIBRARY_${LIBRARY})
  endforeach()
  pkg_check_modules(URDFDOM QUIET IMPORTED_TARGET GLOBAL urdfdom)
  sparflow_require("urdfdom" liburdfdom-dev URDFDOM_FOUND)
  pkg_check_modules(ZSTD QUIET IMPORTED_TARGET GLOBAL libzstd)
  sparflow_require("Zstandard" libzstd-dev ZSTD_FOUND)
  pkg_check_modules(LZ4 QUIET IMPORTED_TARGET GLOBAL liblz4)
  sparflow_require("LZ4" liblz4-dev LZ4_FOUND)
endif()
# OMPL's package file names no target and boost libraries that are not installed: libompl is linked by itself.
find_path(OMPL_INCLUDE ompl/config.h PATHS /usr/include/ompl-1.5)
find_library(OMPL_LIBRARY ompl)
sparflow_require("OMPL" libompl-dev OMPL_INCLUDE AND OMPL_LIBRARY)
find_path(MATIO_INCLUDE matio.h)
find_library(MATIO_LIBRARY matio)
sparflow_require("matio" libmatio-dev MATIO_INCLUDE AND MATIO_LIBRARY)
# matio reads MAT v7.3 by HDF5; plain HDF5 files are read by the same library, whose header has its own path in Debian.
find_library(HDF5_LIBRARY NAMES hdf5_serial hdf5)
sparflow_require("HDF5" libhdf5-dev HDF5_LIBRARY)
find_path(NLOPT_INCLUDE nlopt.h)
find_library(NLOPT_LIBRARY nlopt)
sparflow_require("NLopt" libnlopt-dev NLOPT_INCLUDE AND NLOPT_LIBRARY)
# SUNDIALS' package file names libraries of PETSc, hypre and MPI, which nothing here uses: its parts are linked by themselves.
find_path(SUNDIALS_INCLUDE cvodes/cvodes.h)
set(SUNDIALS_LIBRARIES "")
foreach(PART cvodes nvecserial sunmatrixdense sunlinsoldense)
  find_library(SUNDIALS_${PART} sundials_${PART})
  mark_as_advanced(SUNDIALS_${PART})
  list(APPEND SUNDIALS_LIBRARIES ${SUNDIALS_${PART}})
  sparflow_require("SUNDIALS (${PART})" libsundials-dev SUNDIALS_INCLUDE AND SUNDIALS_${PART})
endforeach()
find_path(KDL_INCLUDE kdl/chain.hpp)
find_library(KDL_LIBRARY orocos-kdl)
sparflow_require("Orocos KDL" liborocos-kdl-dev KDL_INCLUDE AND KDL_LIBRARY)
find_package(OpenSSL QUIET COMPONENTS Crypto)
sparflow_require("OpenSSL" libssl-dev OPENSSL_FOUND)
find_package(ZLIB QUIET)
sparflow_require("zlib" zlib1g-dev ZLIB_FOUND)
if(SPARFLOW_TESTS)
  find_package(GTest QUIET)
  sparflow_require("GoogleTest" libgtest-dev GTest_FOUND)
  sparflow_require("GoogleMock" libgmock-dev TARGET GTest::gmock)
endif()
if(SPARFLOW_BENCH)
  find_package(benchmark QUIET)
  sparflow_require("Google Benchmark" libbenchmark-dev benchmark_FOUND)
endif()
sparflow_report_missing()

add_library(sparflow_ompl INTERFACE)
target_include_directories(sparflow_ompl SYSTEM INTERFACE ${OMPL_INCLUDE})
target_link_libraries(sparflow_ompl INTERFACE ${OMPL_LIBRARY})
# libompl brings its own, older Eigen: see the file.
target_link_options(sparflow_ompl INTERFACE
  "$<BUILD_INTERFACE:LINKER:--version-script=${CMAKE_SOURCE_DIR}/cmake/keep_eigen_private.map>"
  "$<INSTALL_INTERFACE:LINKER:--version-script=$<INSTALL_PREFIX>/lib/cmake/sparflow/keep_eigen_private.map>")

add_library(sparflow_matio INTERFACE)
target_include_directories(sparflow_matio SYSTEM INTERFACE ${MATIO_INCLUDE})
target_link_libraries(sparflow_matio INTERFACE ${MATIO_LIBRARY} ${HDF5_LIBRARY})

add_library(sparflow_nlopt INTERFACE)
target_include_directories(sparflow_nlopt SYSTEM INTERFACE ${NLOPT_INCLUDE})
target_link_libraries(sparflow_nlopt INTERFACE ${NLOPT_LIBRARY})

add_library(sparflow_sundials INTERFACE)
target_include_directories(sparflow_sundials SYSTEM INTERFACE ${SUNDIALS_INCLUDE})
target_link_libraries(sparflow_sundials INTERFACE ${SUNDIALS_LIBRARIES})

add_library(sparflow_kdl INTERFACE)
target_include_directories(sparflow_kdl SYSTEM INTERFACE ${KDL_INCLUDE})
target_link_libraries(sparflow_kdl INTERFACE ${KDL_LIBRARY} Eigen3::Eigen)

add_library(sparflow_urdf INTERFACE)
target_link_libraries(sparflow_urdf INTERFACE PkgConfig::URDFDOM)

# A library may be there and still not link, because one that it needs in turn is not: a program of one line for each
# is compiled and linked now (two seconds, once for each build folder) and not after minutes of compiling.
function(sparflow_check_links NAME LIBRARIES PACKAGE CODE)
  if(SPARFLOW_LINKS_${NAME})
    return()
  endif()
  set(FILE ${CMAKE_BINARY_DIR}/generated/link_${NAME}.cpp)
  file(WRITE ${FILE} "${CODE}\n")
  try_compile(LINKS ${CMAKE_BINARY_DIR}/generated/link_${NAME} SOURCES ${FILE} LINK_LIBRARIES ${LIBRARIES}
              CMAKE_FLAGS "-DINCLUDE_DIRECTORIES=${OMPL_INCLUDE};${MATIO_INCLUDE};${SUNDIALS_INCLUDE};${KDL_INCLUDE};${EIGEN3_INCLUDE_DIRS}" CXX_STANDARD 20 OUTPUT_VARIABLE OUTPUT)
  if(NOT LINKS)
    message(FATAL_ERROR "${NAME} is installed but a program of one line does not link with it; Debian package ${PACKAGE} "
                        "or one that it needs is incomplete:\n${OUTPUT}")
  endif()
  set(SPARFLOW_LINKS_${NAME} ON CACHE INTERNAL "a program of one line links with ${NAME}")
endfunction()
sparflow_check_links(Ipopt PkgConfig::IPOPT coinor-libipopt-dev
  "#include <coin/IpIpoptApplication.hpp>\nint main() { Ipopt::SmartPtr<Ipopt::IpoptApplication> a = new Ipopt::IpoptApplication(); return a->Initialize(); }")
sparflow_check_links(OMPL ${OMPL_LIBRARY} libompl-dev
  "#include <ompl/util/Console.h>\nint main() { ompl::msg::setLogLevel(ompl::msg::LOG_NONE); }")
sparflow_check_links(matio ${MATIO_LIBRARY} libmatio-dev
  "#include <matio.h>\nint main() { Mat_Close(Mat_Open(\"\", MAT_ACC_RDONLY)); }")
sparflow_check_links(urdfdom PkgConfig::URDFDOM liburdfdom-dev
  "#include <urdf_parser/urdf_parser.h>\nint main() { return urdf::parseURDF(\"\") == nullptr; }")
sparflow_check_links(yaml_cpp yaml-cpp libyaml-cpp-dev "#include <yaml-cpp/yaml.h>\nint main() { return YAML::Load(\"1\").IsNull(); }")
sparflow_check_links(SUNDIALS "${SUNDIALS_LIBRARIES}" libsundials-dev
  "#include <cvodes/cvodes.h>\nint main() { void* memory = CVodeCreate(CV_BDF, nullptr); CVodeFree(&memory); }")
sparflow_check_links(KDL ${KDL_LIBRARY} liborocos-kdl-dev
  "#include <kdl/chain.hpp>\nint main() { return static_cast<int>(KDL::Chain().getNrOfJoints()); }")
