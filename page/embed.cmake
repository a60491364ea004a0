# cmake -DOUT=assets.cpp -DDIRECTORY=page -DCHART=chart.min.js -P embed.cmake: the page's files as C++.
set(text "// Made by page/embed.cmake.\n#include \"page/assets.h\"\n\n")
string(APPEND text "#pragma GCC diagnostic ignored \"-Woverlength-strings\"\n\nnamespace forereach {\n")
foreach(asset kPageBody=${DIRECTORY}/page.html kPageStyle=${DIRECTORY}/page.css kPageScript=${DIRECTORY}/page.js
    kChartScript=${CHART})
  string(REGEX MATCH "^([^=]+)=(.+)$" ignored "${asset}")
  set(name ${CMAKE_MATCH_1})
  set(file ${CMAKE_MATCH_2})
  file(READ ${file} content)
  file(SHA256 ${file} digest)
  string(APPEND text "\nconst PageAsset ${name}{R\"~~~~~~(" "${content}" ")~~~~~~\", \"${digest}\"};\n")
endforeach()
file(WRITE ${OUT} "${text}\n}  // namespace forereach\n")
