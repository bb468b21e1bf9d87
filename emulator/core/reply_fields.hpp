#pragma once

/// @file What a reply can say, by the names that expectations have for it.

#include <optional>
#include <span>
#include <string_view>

#include "protocol/replies.hpp"

namespace lk::emulator {

struct ReplyField {
  std::string_view name;  // "voltage_V"
  std::optional<double> (*read)(const protocol::Reply& reply);
};

std::span<const ReplyField> reply_fields();

/// The error bits of a reply that has them.
std::optional<unsigned> reply_errors(const protocol::Reply& reply);

}  // namespace lk::emulator
