# farfeel_bundle(ENTRY OUT WORD): has esbuild make one classic script and one style sheet of a page's sources and of the npm packages that
# these import: OUT.js and OUT.css. WORD is what it is called while it is built. farfeel_can_bundle tells whether there is what
# that takes: deploy/install-packages fetches it, as view/page/package-lock.json pins it.
find_program(ESBUILD esbuild)
set(page_packages "${PROJECT_SOURCE_DIR}/build/page-packages/node_modules")
set(farfeel_can_bundle OFF)
if(ESBUILD AND EXISTS "${page_packages}/three/package.json" AND EXISTS "${page_packages}/uplot/package.json")
  set(farfeel_can_bundle ON)
else()
  message(STATUS "no live view, and no plots in reports: deploy/install-packages fetches three.js, uPlot and esbuild, which they are "
                 "made of")
endif()
function(farfeel_bundle entry out word)
  get_filename_component(folder "${entry}" DIRECTORY)
  file(GLOB sources CONFIGURE_DEPENDS "${folder}/*.js" "${folder}/*.css" "${PROJECT_SOURCE_DIR}/master_station/plots/*.js"
       "${PROJECT_SOURCE_DIR}/master_station/plots/*.css")
  add_custom_command(OUTPUT "${out}.js" "${out}.css"
    COMMAND ${CMAKE_COMMAND} -E env "NODE_PATH=${page_packages}" ${ESBUILD} "${entry}" --bundle --minify --format=iife
            --log-level=warning "--outfile=${out}.js"
    DEPENDS ${sources} "${page_packages}/three/package.json" "${page_packages}/uplot/package.json"
    COMMENT "Bundling ${word}" VERBATIM)
endfunction()
