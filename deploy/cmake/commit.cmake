# cmake -DROOT=... -DOUT=... -P commit.cmake: the commit that the tree stands at, as a header; untouched where it says so.
cmake_minimum_required(VERSION 3.25)
execute_process(COMMAND git -C "${ROOT}" describe --always --dirty --abbrev=10 --exclude=*
  OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(NOT commit)
  set(commit "no commit known")
endif()
file(CONFIGURE OUTPUT "${OUT}" CONTENT "#define FARFEEL_COMMIT \"@commit@\"\n" @ONLY)
