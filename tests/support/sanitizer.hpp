#pragma once

#if defined(__SANITIZE_ADDRESS__)  // GCC's way of saying it
#define LKEMU_ADDRESS_SANITIZER true
#elif defined(__has_feature)  // Clang's
#define LKEMU_ADDRESS_SANITIZER __has_feature(address_sanitizer)
#else
#define LKEMU_ADDRESS_SANITIZER false
#endif

namespace lk {

/// This build is ten to twenty times as slow, keeps what was freed, and opens pipes of its own:
/// UBSan, to see whether an object is where a call says it is.
inline constexpr bool kAddressSanitizer = LKEMU_ADDRESS_SANITIZER;

}  // namespace lk

#undef LKEMU_ADDRESS_SANITIZER
