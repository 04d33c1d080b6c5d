# The Python module (apps/python): built where Debian's pybind11 and NumPy are found, never under sanitizers, because
# Python itself is not instrumented.
set(SPARFLOW_PYTHON_POSSIBLE ON)
if(SPARFLOW_SANITIZE OR SPARFLOW_FUZZ)
  set(SPARFLOW_PYTHON_POSSIBLE OFF)
endif()
if(SPARFLOW_PYTHON STREQUAL "")
  set(SPARFLOW_PYTHON_WANTED ${SPARFLOW_PYTHON_POSSIBLE})
else()
  set(SPARFLOW_PYTHON_WANTED ${SPARFLOW_PYTHON})
endif()
if(NOT SPARFLOW_PYTHON_WANTED OR NOT SPARFLOW_PYTHON_POSSIBLE)
  return()
endif()
# Debian's interpreter, whose packages the module uses, and not one that happens to stand first in the path.
if(NOT DEFINED Python_EXECUTABLE AND EXISTS /usr/bin/python3)
  set(Python_EXECUTABLE /usr/bin/python3)
endif()
find_package(Python 3.9 QUIET COMPONENTS Interpreter Development.Module NumPy)
find_package(pybind11 2.9 QUIET CONFIG)
if(NOT Python_FOUND OR NOT pybind11_FOUND)
  if(SPARFLOW_PYTHON STREQUAL "")
    message(STATUS "no Python module: it needs the Debian packages pybind11-dev, python3-dev and python3-numpy")
    return()
  endif()
  message(FATAL_ERROR "SPARFLOW_PYTHON is on, but pybind11, Python's headers or NumPy are missing\n"
                      "On Debian 12: apt-get install --no-install-recommends pybind11-dev python3-dev python3-numpy")
endif()

file(GLOB PYTHON_SOURCES CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/apps/python/*.cpp)
pybind11_add_module(sparflow_python MODULE NO_EXTRAS ${PYTHON_SOURCES})
# Together with its Python files the module makes up a package that can be imported from the build folder.
set(SPARFLOW_PACKAGE ${CMAKE_BINARY_DIR}/python/sparflow)
set_target_properties(sparflow_python PROPERTIES OUTPUT_NAME _sparflow LIBRARY_OUTPUT_DIRECTORY ${SPARFLOW_PACKAGE}
                      UNITY_BUILD OFF CXX_VISIBILITY_PRESET hidden)
target_link_libraries(sparflow_python PRIVATE sparflow_flags sparflow_tasks nlohmann_json::nlohmann_json)
sparflow_text_code(sparflow_python)
file(GLOB PYTHON_FILES CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/apps/python/sparflow/*)
add_custom_command(TARGET sparflow_python POST_BUILD COMMAND ${CMAKE_COMMAND} -E copy_if_different ${PYTHON_FILES} ${SPARFLOW_PACKAGE}
                   VERBATIM)
# A change of a Python file alone must reach the package as well.
set_property(TARGET sparflow_python APPEND PROPERTY LINK_DEPENDS ${PYTHON_FILES})

# Where Python finds it after `cmake --install`: below the prefix, as Debian's packages have it.
set(SPARFLOW_PYTHON_DIR lib/python3/dist-packages CACHE STRING "folder of the Python package below the prefix")
install(TARGETS sparflow_python LIBRARY DESTINATION ${SPARFLOW_PYTHON_DIR}/sparflow COMPONENT python)
install(FILES ${PYTHON_FILES} DESTINATION ${SPARFLOW_PYTHON_DIR}/sparflow COMPONENT python)

if(SPARFLOW_TESTS)
  enable_testing()
  file(GLOB PYTHON_TESTS CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/tests/python/*_test.py)
  file(STRINGS ${CMAKE_SOURCE_DIR}/tests/python/slow_files.txt SPARFLOW_SLOW_PYTHON REGEX "^[^#]")
  foreach(FILE ${PYTHON_TESTS})
    get_filename_component(NAME ${FILE} NAME_WE)
    set(LABEL fast_python)
    if(NAME IN_LIST SPARFLOW_SLOW_PYTHON)
      set(LABEL slow_python)
    endif()
    add_test(NAME Python.${NAME} COMMAND ${Python_EXECUTABLE} -m pytest -q -p no:cacheprovider ${FILE})
    set_tests_properties(Python.${NAME} PROPERTIES LABELS ${LABEL} TIMEOUT 600 ENVIRONMENT
      "PYTHONPATH=${CMAKE_BINARY_DIR}/python;PYTHONDONTWRITEBYTECODE=1;OPENBLAS_NUM_THREADS=1;SPARFLOW_SOURCE_DIR=${CMAKE_SOURCE_DIR};SPARFLOW_BINARY_DIR=${CMAKE_BINARY_DIR}")
  endforeach()
  file(GLOB PYTHON_EXAMPLES CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/examples/python/*.py)
  foreach(FILE ${PYTHON_EXAMPLES})
    get_filename_component(NAME ${FILE} NAME_WE)
    set(LABEL fast_python)
    if(NAME IN_LIST SPARFLOW_SLOW_PYTHON)
      set(LABEL slow_python)
    endif()
    add_test(NAME Notebooks.${NAME} COMMAND ${Python_EXECUTABLE} ${FILE})
    set_tests_properties(Notebooks.${NAME} PROPERTIES LABELS ${LABEL} TIMEOUT 600 WORKING_DIRECTORY ${CMAKE_BINARY_DIR} ENVIRONMENT
      "PYTHONPATH=${CMAKE_BINARY_DIR}/python;PYTHONDONTWRITEBYTECODE=1;OPENBLAS_NUM_THREADS=1")
  endforeach()
endif()
