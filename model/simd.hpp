#pragma once

/// @file `stdx`: std::experimental::simd of libstdc++, or what stands for it where there is none.
/// libc++ has a header of that name, with a part of what it should have.

#include <version>

#if defined(__GLIBCXX__) && !defined(LKEMU_ARRAY_SIMD)
#include <experimental/simd>
namespace lk::model {
namespace stdx = std::experimental;
}
#else
#include "model/array_simd.hpp"
namespace lk::model {
namespace stdx = array_simd;
}
#endif
