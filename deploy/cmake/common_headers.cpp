// The target of the precompiled headers needs a source; they are named in CMakeLists.txt.
