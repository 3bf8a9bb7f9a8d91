# The list of mechanisms against the rooms that it is of:
# - a mechanism's source is there, and asks whether it is left out; who asks is in the list, and is no header;
# - a file of the three rooms with tuned constants belongs to a mechanism, or to a job below that nobody can leave out;
# - ARCHITECTURE.md's table of mechanisms names each.
cmake_minimum_required(VERSION 3.25)
include("${CMAKE_CURRENT_LIST_DIR}/sources.cmake")
set(list "haptic_core/ablation/ablation.h")
set(rooms "^haptic_core/(contact|contact_service|local_model)/")

# Jobs that have to be done one way or another; without them nothing is felt, or tests of their own fail.
set(jobs
  haptic_core/contact/cluster                      # how many pieces a patch knows, and how squarely a pair counts
  haptic_core/contact/contact_set                  # how many contacts an answer has
  haptic_core/contact/curvature                    # a second derivative, as it travels
  haptic_core/contact/doubts                       # what is said of a doubt
  haptic_core/contact/friction                     # the law of friction
  haptic_core/contact/material                     # what a surface is made of, and two of them together
  haptic_core/contact/touchable                    # what a scene or a program sets
  haptic_core/contact/depth/constants              # the numbers of depth, each with what needs it
  haptic_core/contact/depth/points/constants       # the numbers of points
  haptic_core/contact/tracking/constants           # the numbers of patches and tracks
  haptic_core/contact/depth/plane_depth            # the closed form itself
  haptic_core/contact/depth/tiles_under            # which tiles a depth is made from
  haptic_core/contact/depth/points/faceted_surface # a felt surface as facets
  haptic_core/contact/depth/points/nearest_facets  # which facets a point is compared with
  haptic_core/contact/depth/points/stacked_pieces  # which pieces lie above each other
  haptic_core/contact/depth/points/surface_points  # points of a felt surface
  haptic_core/contact/tracking/contact_tracker     # which contact is which
  haptic_core/contact/tracking/deepest             # how deep anything is looked up
  haptic_core/contact/tracking/track_names         # contacts' names
  haptic_core/contact_service/constants            # the numbers of the façade and the proxy
  haptic_core/contact_service/felt_scene           # what is felt of a scene
  haptic_core/local_model/constants                # its numbers, each with what needs it
  haptic_core/local_model/news_age                 # how old an answer is, beyond what the lane takes
  haptic_core/local_model/tangent                  # a linearised contact
  haptic_core/local_model/tile_cache)              # tiles as they arrive

set(complaints "")
file(STRINGS "${ROOT}/${list}" lines REGEX "^ *Named{")
file(READ "${ROOT}/ARCHITECTURE.md" architecture)
set(homes ${jobs})
set(known "")
foreach(line IN LISTS lines)
  if(NOT line MATCHES "Mechanism::(k[A-Za-z]+), \"([^\"]+)\", \"([^\"]+)\"")
    list(APPEND complaints "${list}: not understood:${line}")
    continue()
  endif()
  set(mechanism "${CMAKE_MATCH_1}")
  set(name "${CMAKE_MATCH_2}")
  set(source "${CMAKE_MATCH_3}")
  list(APPEND known "${source}:${mechanism}")
  string(REGEX REPLACE "[.]cpp$" "" home "${source}")
  list(APPEND homes "${home}")
  if(NOT EXISTS "${ROOT}/${source}")
    list(APPEND complaints "${list}: ${name} is said to be in ${source}, which is not there")
    continue()
  endif()
  file(STRINGS "${ROOT}/${source}" asks REGEX "ablated\\(Mechanism::${mechanism}\\)")
  if(NOT asks)
    list(APPEND complaints "${source} never asks whether ${name} is left out")
  endif()
  string(FIND "${architecture}" "\n| ${name} |" at)
  if(at EQUAL -1)
    list(APPEND complaints "ARCHITECTURE.md's table of mechanisms has no row for ${name}")
  endif()
endforeach()
list(LENGTH lines mechanism_count)
if(mechanism_count EQUAL 0)
  list(APPEND complaints "${list} lists no mechanism")
endif()

set(tuned_count 0)
foreach(source IN LISTS sources)
  if(source STREQUAL list OR source MATCHES "^tests/")
    continue()
  endif()
  file(STRINGS "${ROOT}/${source}" asks REGEX "ablated\\(Mechanism::")
  foreach(ask IN LISTS asks)
    string(REGEX MATCHALL "ablated\\(Mechanism::k[A-Za-z]+" all "${ask}")
    foreach(one IN LISTS all)
      string(REGEX REPLACE ".*::" "" mechanism "${one}")
      if(NOT "${source}:${mechanism}" IN_LIST known)
        list(APPEND complaints "${source} leaves out ${mechanism}: ${list} does not say that it is there")
      endif()
    endforeach()
  endforeach()
  if(NOT source MATCHES "${rooms}")
    continue()
  endif()
  # A number with a name, in a constant or as a setting's default.
  file(STRINGS "${ROOT}/${source}" tuned REGEX "(constexpr .*[ ,]k[A-Z][A-Za-z0-9_]*|_(m|s|N|J|rad|Nm)|_per_[a-zA-Z]+) *(=|{) *-?[0-9.]*[1-9]")
  if(NOT tuned)
    continue()
  endif()
  math(EXPR tuned_count "${tuned_count} + 1")
  string(REGEX REPLACE "[.](h|cpp)$" "" home "${source}")
  if(NOT home IN_LIST homes)
    list(APPEND complaints "${source} has tuned numbers, and belongs to no mechanism of ${list} and to no job that is named here")
  endif()
endforeach()
foreach(job IN LISTS jobs)
  if(NOT EXISTS "${ROOT}/${job}.h" AND NOT EXISTS "${ROOT}/${job}.cpp")
    list(APPEND complaints "mechanisms.cmake names the job ${job}, which is not there")
  endif()
endforeach()

if(complaints)
  list(JOIN complaints "\n" complaints)
  message("${complaints}")
  message(FATAL_ERROR "the places are named above")
endif()
message("${mechanism_count} mechanisms, and ${tuned_count} files of the rooms with tuned numbers, which all belong to one or to a job")
