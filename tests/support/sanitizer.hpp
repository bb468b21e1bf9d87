#pragma once

#if defined(__SANITIZE_ADDRESS__)  // GCC
#define LKEMU_ADDRESS_SANITIZER true
#elif defined(__has_feature)  // Clang
#define LKEMU_ADDRESS_SANITIZER __has_feature(address_sanitizer)
#else
#define LKEMU_ADDRESS_SANITIZER false
#endif

namespace lk {

/// Such builds are ten to twenty times as slow and keep freed memory. UBSan also opens pipes, to
/// check whether an object exists.
inline constexpr bool kAddressSanitizer = LKEMU_ADDRESS_SANITIZER;

}  // namespace lk

#undef LKEMU_ADDRESS_SANITIZER
