// CMake wants a source in every target; see precompiled.hpp.
