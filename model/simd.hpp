#pragma once

/// @file `stdx`: std::experimental::simd of libstdc++, or model/array_simd.hpp as a replacement.
/// The header of libc++ is incomplete and not used.

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
