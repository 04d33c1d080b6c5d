# Embeds the files of apps/report/assets into sparflow_report as C++ raw strings, at build time.
# This file is also the script that writes them: cmake -DOUTPUT=... -DASSETS=dir -DFILES=a,b -P embed.cmake
set(SPARFLOW_PAGE_ASSETS uplot/uPlot.iife.min.js uplot/uPlot.min.css uplot/LICENSE
    page.css page.js line_charts.js svg_charts.js crane_drawing.js)

if(CMAKE_SCRIPT_MODE_FILE)
  string(REPLACE "," ";" FILES "${FILES}")
  set(CODE "#include \"apps/report/page/assets.h\"\nnamespace sparflow {\nstd::string_view page_asset(std::string_view name) {\n")
  foreach(NAME ${FILES})
    file(READ "${ASSETS}/${NAME}" TEXT)
    string(FIND "${TEXT}" ")_asset_\"" CLASH)
    if(NOT CLASH EQUAL -1)
      message(FATAL_ERROR "${NAME} contains the raw string's end mark )_asset_\"")
    endif()
    string(APPEND CODE "  if (name == \"${NAME}\") return R\"_asset_(${TEXT})_asset_\";\n")
  endforeach()
  string(APPEND CODE "  return {};\n}\n}  // namespace sparflow\n")
  file(WRITE "${OUTPUT}" "${CODE}")
  return()
endif()

if(TARGET sparflow_report)
  set(OUTPUT ${CMAKE_BINARY_DIR}/generated/page_assets.cpp)
  set(DEPENDS)
  foreach(NAME ${SPARFLOW_PAGE_ASSETS})
    list(APPEND DEPENDS ${CMAKE_SOURCE_DIR}/apps/report/assets/${NAME})
  endforeach()
  list(JOIN SPARFLOW_PAGE_ASSETS "," FILES)
  add_custom_command(
    OUTPUT ${OUTPUT}
    COMMAND ${CMAKE_COMMAND} -DOUTPUT=${OUTPUT} -DASSETS=${CMAKE_SOURCE_DIR}/apps/report/assets
            -DFILES=${FILES} -P ${CMAKE_CURRENT_LIST_FILE}
    DEPENDS ${DEPENDS} ${CMAKE_CURRENT_LIST_FILE}
    COMMENT "Embedding page assets" VERBATIM)
  target_sources(sparflow_report PRIVATE ${OUTPUT})
  # by itself: clang-tidy reads batches of sources in a folder where nothing is built
  set_source_files_properties(${OUTPUT} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endif()
