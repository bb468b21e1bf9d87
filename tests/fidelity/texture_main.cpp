/// @file fidelity_texture: prints the generated table of docs/internals/model.md §15.

#include <cstdio>

#include "tests/fidelity/texture_table.hpp"

int main() { std::fputs(lk::test::texture_table().c_str(), stdout); }
