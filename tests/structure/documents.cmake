# What the documents point at is there: relative links, `paths/in/backticks` and `deploy/commands`, and the programs that
# are named; and the glossary is short. PROGRAMS: the executables that the build makes, separated by commas.
cmake_minimum_required(VERSION 3.25)
string(REPLACE "," ";" programs "${PROGRAMS}")
set(complaints "")
set(checked 0)
file(GLOB_RECURSE documents RELATIVE "${ROOT}" "${ROOT}/*.md")
list(FILTER documents EXCLUDE REGEX "^(build|out|shared|\\.)")

foreach(document IN LISTS documents)
  get_filename_component(here "${ROOT}/${document}" DIRECTORY)
  file(READ "${ROOT}/${document}" text)
  string(REPLACE ";" "," text "${text}")  # so that no list is split inside a sentence
  string(REPLACE "[" "(" links "${text}")
  string(REPLACE "]" ")" links "${links}")

  # Links: [text](target#anchor), by now (text)(target#anchor).
  string(REGEX MATCHALL "\\)\\([^()\n]+\\)" links "${links}")
  foreach(link IN LISTS links)
    string(REGEX REPLACE "^\\)\\(([^#)]*).*" "\\1" target "${link}")
    if(target STREQUAL "" OR target MATCHES "^[a-z]+:")
      continue()
    endif()
    math(EXPR checked "${checked} + 1")
    if(NOT EXISTS "${here}/${target}")
      list(APPEND complaints "${document}: there is no ${target} to link to")
    endif()
  endforeach()

  # Paths: a name that begins with one of our folders and holds no placeholder.
  string(REGEX MATCHALL
    "(haptic_core|codecs|transport|slave_sim|master_station|tests|deploy|docs)/[A-Za-z0-9_./<>*{}-]*" paths "${text}")
  list(REMOVE_DUPLICATES paths)
  foreach(path IN LISTS paths)
    if(path MATCHES "[<>*{}]")
      continue()
    endif()
    string(REGEX REPLACE "[.]+$" "" path "${path}")
    math(EXPR checked "${checked} + 1")
    if(NOT EXISTS "${ROOT}/${path}" AND NOT EXISTS "${here}/${path}")
      list(APPEND complaints "${document}: there is no ${path}")
    endif()
  endforeach()

  # Programs, however they are called: `farfeel-slave`, build/release/bin/farfeel-slave.
  string(REGEX MATCHALL "farfeel-[a-z]+" names "${text}")
  string(REGEX MATCHALL "build/[a-z]+/bin/[a-z-]+" called "${text}")
  list(TRANSFORM called REPLACE ".*/" "")
  list(APPEND names ${called})
  list(REMOVE_DUPLICATES names)
  foreach(name IN LISTS names)
    math(EXPR checked "${checked} + 1")
    if(NOT name IN_LIST programs)
      list(APPEND complaints "${document}: no program is called ${name}")
    endif()
  endforeach()
endforeach()

# Few words: a glossary is read once and remembered.
file(STRINGS "${ROOT}/ARCHITECTURE.md" words REGEX "^(## Words|[|] |## The life)")
set(terms -1)  # less the table's head
set(is_glossary FALSE)
foreach(line IN LISTS words)
  if(line MATCHES "^## ")
    string(COMPARE EQUAL "${line}" "## Words" is_glossary)
  elseif(is_glossary)
    math(EXPR terms "${terms} + 1")
  endif()
endforeach()
if(terms LESS 1 OR terms GREATER 40)
  list(APPEND complaints "ARCHITECTURE.md's glossary has ${terms} terms, and 40 at most are remembered")
endif()

if(complaints)
  list(JOIN complaints "\n" complaints)
  message("${complaints}")
  message(FATAL_ERROR "the places are named above")
endif()
message("${checked} links, paths and programs of the documents are there")
