#pragma once

/// @file A list of values of different types, for tables. Replaces std::tuple, which for so many
/// rows would add a second to the compile time of each file that includes a table.

#include <cstddef>
#include <type_traits>
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

/// Returns a list with the values of `first`, followed by the values of `second`.
template <class First, class Second>
constexpr auto joined(const First& first, const Second& second) {
  return [&]<std::size_t... kFirst, std::size_t... kSecond>(std::index_sequence<kFirst...>,
                                                            std::index_sequence<kSecond...>) {
    return rows(at<kFirst>(first)..., at<kSecond>(second)...);
  }
  (std::make_index_sequence<First::kSize>{}, std::make_index_sequence<Second::kSize>{});
}

namespace row_codec {

template <const auto& kRows>
constexpr std::size_t kCount = std::remove_cvref_t<decltype(kRows)>::kSize;
template <const auto& kRows, std::size_t kPlace>
using RowAt = std::remove_cvref_t<decltype(at<kPlace>(kRows))>;

template <class Row>
using QueryOf = typename Row::QueryType;
template <class Row>
using ReplyOf = typename Row::ReplyType;

/// Returns the index of the first row whose `TypeOf` is `Kind`; kCount if no row has it.
template <const auto& kRows, template <class> class TypeOf, class Kind>
constexpr std::size_t place() {
  return []<std::size_t... N>(std::index_sequence<N...>) {
    std::size_t place = kCount<kRows>;
    static_cast<void>(
        ((std::is_same_v<TypeOf<RowAt<kRows, N>>, Kind> && (place = N, true)) || ...));
    return place;
  }
  (std::make_index_sequence<kCount<kRows>>{});
}
template <const auto& kRows, class Kind>
constexpr std::size_t query_place() {
  return place<kRows, QueryOf, Kind>();
}
template <const auto& kRows, class Kind>
constexpr std::size_t reply_place() {
  return place<kRows, ReplyOf, Kind>();
}

}  // namespace row_codec
}  // namespace lk::protocol
