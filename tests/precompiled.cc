// Nothing of its own: the source that the tests' precompiled header is made for (CMakeLists.txt).
