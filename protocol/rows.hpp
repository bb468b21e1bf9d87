#pragma once

/// @file A list of values of different types, for tables. A std::tuple of that many rows costs each
/// including file a second of compile time.

#include <cstddef>
#include <utility>

namespace lk::protocol {

template <std::size_t kPlace, class T>
struct RowLeaf {
  T value;
};

template <class Places, class... T>
struct RowList;
template <std::size_t... kPlaces, class... T>
struct RowList<std::index_sequence<kPlaces...>, T...> : RowLeaf<kPlaces, T>... {
  static constexpr std::size_t kSize = sizeof...(T);
};

template <class... T>
constexpr auto rows(const T&... values) {
  return RowList<std::index_sequence_for<T...>, T...>{{values}...};
}

/// Returns the value at `kPlace`.
template <std::size_t kPlace, class T>
constexpr const T& at(const RowLeaf<kPlace, T>& leaf) {
  return leaf.value;
}

/// Returns the values of `first`, then those of `second`.
template <class First, class Second>
constexpr auto joined(const First& first, const Second& second) {
  return [&]<std::size_t... kFirst, std::size_t... kSecond>(std::index_sequence<kFirst...>,
                                                            std::index_sequence<kSecond...>) {
    return rows(at<kFirst>(first)..., at<kSecond>(second)...);
  }
  (std::make_index_sequence<First::kSize>{}, std::make_index_sequence<Second::kSize>{});
}

}  // namespace lk::protocol
