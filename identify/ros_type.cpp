#include "identify/ros_type.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "command_line/nearest.h"
#include "task/config_error.h"
#include "task/line_reader.h"

namespace forereach {
namespace {

constexpr int kDeepestRosType = 32;

enum class RosForm { kUnsigned, kSigned, kFloat, kText };
struct RosPrimitive {
  std::string_view name;
  RosForm form;
  std::size_t size;
};
constexpr RosPrimitive kRosPrimitives[] = {
    {"bool", RosForm::kUnsigned, 1},   {"byte", RosForm::kUnsigned, 1},   {"char", RosForm::kUnsigned, 1},
    {"int8", RosForm::kSigned, 1},     {"uint8", RosForm::kUnsigned, 1},  {"int16", RosForm::kSigned, 2},
    {"uint16", RosForm::kUnsigned, 2}, {"int32", RosForm::kSigned, 4},    {"uint32", RosForm::kUnsigned, 4},
    {"int64", RosForm::kSigned, 8},    {"uint64", RosForm::kUnsigned, 8}, {"float32", RosForm::kFloat, 4},
    {"float64", RosForm::kFloat, 8},   {"string", RosForm::kText, 1},     {"wstring", RosForm::kText, 2}};

const RosPrimitive* FindRosPrimitive(std::string_view name) {
  const auto found = std::ranges::find(kRosPrimitives, name, &RosPrimitive::name);
  return found == std::end(kRosPrimitives) ? nullptr : found;
}

// "package/Type" of "package/msg/Type".
std::string Short(std::string_view name) {
  const std::size_t at = name.find("/msg/");
  return at == std::string_view::npos ? std::string(name)
                                      : fmt::format("{}/{}", name.substr(0, at), name.substr(at + 5));
}

// The next word of a line.
std::string_view TakeWord(std::string_view& line) {
  line = Trimmed(line);
  const std::size_t end = std::min(line.find_first_of(" \t"), line.size());
  const std::string_view word = line.substr(0, end);
  line.remove_prefix(end);
  return word;
}

}  // namespace

RosType::RosType(std::string name, std::string_view text) : name_(Short(name)) {
  std::string type = name_, section;
  int line = 0, first = 1;
  const auto end_section = [&] {
    AddText(type, section, first);
    section.clear();
    first = line + 1;
  };
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view content = Trimmed(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    ++line;
    if (content.starts_with("====")) {
      end_section();
      type.clear();
    } else if (type.empty() && content.starts_with("MSG: ")) {
      type = Short(Trimmed(content.substr(5)));
      first = line + 1;
    } else {
      section.append(content).append("\n");
    }
  }
  end_section();
  for (const auto& [user, members] : types_)
    for (const Member& member : members)
      if (!FindRosPrimitive(member.type) && !types_.contains(member.type))
        throw ConfigError("the schema of {} lacks the type {} of {}.{}", name_, member.type, user, member.name);
  if (!types_.contains(name_)) throw ConfigError("a schema without a name");
}

void RosType::AddText(const std::string& type, std::string_view text, int line) {
  Members members;
  for (; !text.empty(); ++line) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view rest = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    rest = Trimmed(rest.substr(0, rest.find('#')));
    if (rest.empty()) continue;
    std::string_view kind = TakeWord(rest);
    const std::string_view name = TakeWord(rest);
    const auto fail = [&](const char* what) { throw ConfigError("the schema of {}, line {}: {}", name_, line, what); };
    if (name.empty()) fail("a type without the name of a member");
    if (name.find('=') != std::string_view::npos || Trimmed(rest).starts_with('=')) continue;  // a constant
    Member member{"", std::string(name)};
    if (const std::size_t open = kind.find('['); open != std::string_view::npos) {
      const std::string_view size = kind.substr(open + 1);
      const auto [at, error] = std::from_chars(size.data(), size.data() + size.size(), member.size);
      member.count = error == std::errc() ? Member::Count::kFixed : Member::Count::kCounted;
      if (!size.ends_with(']') || (error == std::errc() && (at + 1 != size.data() + size.size() || member.size == 0)))
        fail("an array whose size is no number from 1 up");
      kind = kind.substr(0, open);
    }
    kind = kind.substr(0, kind.find("<="));  // a bounded text
    member.type = FindRosPrimitive(kind) ? std::string(kind) : Short(kind);
    if (kind == "Header") member.type = "std_msgs/Header";
    if (!FindRosPrimitive(kind) && member.type.find('/') == std::string::npos)
      member.type = type.substr(0, type.find('/') + 1) + member.type;
    members.push_back(std::move(member));
  }
  if (!type.empty()) types_[type] = std::move(members);
}

void RosType::RequireNumber(const std::vector<PlaceStep>& place) const {
  std::string type = name_, at;
  bool is_array = false;
  for (const PlaceStep& step : place) {
    if (step.name.empty()) {
      if (!std::exchange(is_array, false)) throw ConfigError("{} of {} is no array", at, name_);
      at += fmt::format("[{}]", step.entry);
      continue;
    }
    const Members* const members = FindRosPrimitive(type) || is_array ? nullptr : &MembersOf(type);
    const auto member = members ? std::ranges::find(*members, step.name, &Member::name) : Members::const_iterator();
    at += (at.empty() ? "" : ".") + step.name;
    if (!members || member == members->end()) {
      const std::string names = Joined(members ? *members : Members(), [](const Member& each) { return each.name; });
      throw ConfigError("{} has no {}{}", name_, at, names.empty() ? "" : fmt::format("; there are {}", names));
    }
    type = member->type;
    is_array = member->count != Member::Count::kOne;
  }
  const RosPrimitive* const primitive = FindRosPrimitive(type);
  if (is_array || !primitive || primitive->form == RosForm::kText)
    throw ConfigError("{} of {} is no number but {}{}", at, name_, type, is_array ? "[]" : "");
}

// Walks through a message once. What of the wanted places begins with the present one is a range of them.
class RosType::Walker {
 public:
  Walker(const RosType& type, const std::vector<std::vector<PlaceStep>>& places, std::string_view message)
      : type_(type), values_(places.size(), std::numeric_limits<double>::quiet_NaN()), message_(message) {
    for (std::size_t i = 0; i < places.size(); ++i) wanted_.push_back({places[i], i});
  }

  std::optional<std::vector<double>> Walk() {
    if (message_.size() < kHead || message_[0] != 0) return std::nullopt;
    const auto kind = static_cast<unsigned char>(message_[1]);
    if (kind > 1) return std::nullopt;
    is_little_ = kind == 1;
    message_.remove_prefix(kHead);
    if (!Struct(type_.name_, wanted_, 0)) return std::nullopt;
    if (message_.size() - at_ >= 4) return std::nullopt;  // more than padding
    return std::move(values_);
  }

 private:
  static constexpr std::size_t kHead = 4;
  struct Wanted {
    std::span<const PlaceStep> rest;
    std::size_t index;
  };
  using Wanteds = std::vector<Wanted>;

  // Those that go on with this step, behind it.
  static Wanteds Behind(const Wanteds& wanted, const std::string& name, std::size_t entry) {
    Wanteds behind;
    for (const Wanted& each : wanted)
      if (!each.rest.empty() && each.rest.front().name == name && each.rest.front().entry == entry)
        behind.push_back({each.rest.subspan(1), each.index});
    return behind;
  }

  bool Align(std::size_t size) { return Advance((size - at_ % size) % size); }
  bool Advance(std::size_t bytes) {
    if (bytes > message_.size() - at_) return false;
    at_ += bytes;
    return true;
  }

  std::optional<std::uint64_t> Number(std::size_t size) {
    if (!Align(size) || size > message_.size() - at_) return std::nullopt;
    std::uint64_t number = 0;
    for (std::size_t i = 0; i < size; ++i)
      number |= std::uint64_t{static_cast<unsigned char>(message_[at_ + i])} << 8 * (is_little_ ? i : size - 1 - i);
    at_ += size;
    return number;
  }

  static double ValueOf(const RosPrimitive& primitive, std::uint64_t bits) {
    if (primitive.form == RosForm::kFloat)
      return primitive.size == 8 ? std::bit_cast<double>(bits)
                                 : double{std::bit_cast<float>(static_cast<std::uint32_t>(bits))};
    if (primitive.form == RosForm::kUnsigned) return static_cast<double>(bits);
    const auto unused = static_cast<int>(64 - 8 * primitive.size);
    return static_cast<double>(static_cast<std::int64_t>(bits << unused) >> unused);
  }

  bool Value(const std::string& type, const Wanteds& wanted, int depth) {
    const RosPrimitive* const primitive = FindRosPrimitive(type);
    if (!primitive) return Struct(type, wanted, depth + 1);
    if (primitive->form == RosForm::kText) {
      const auto length = Number(4);
      return length && *length <= message_.size() && Advance(static_cast<std::size_t>(*length) * primitive->size);
    }
    const auto bits = Number(primitive->size);
    if (bits)
      for (const Wanted& each : wanted) values_[each.index] = ValueOf(*primitive, *bits);
    return bits.has_value();
  }

  bool Struct(const std::string& type, const Wanteds& wanted, int depth) {
    const Members& members = type_.MembersOf(type);
    if (depth > kDeepestRosType) return false;
    if (members.empty()) return Advance(1);  // ROS gives it a member
    return std::ranges::all_of(members, [&](const Member& member) {
      const Wanteds here = Behind(wanted, member.name, 0);
      if (member.count == Member::Count::kOne) return Value(member.type, here, depth);
      const auto count = member.count == Member::Count::kFixed ? std::optional<std::uint64_t>(member.size) : Number(4);
      if (!count || *count > message_.size() - at_) return false;  // each takes a byte at least
      for (std::size_t i = 0; i < *count; ++i)
        if (!Value(member.type, here.empty() ? here : Behind(here, "", i), depth)) return false;
      return true;
    });
  }

  const RosType& type_;
  Wanteds wanted_;
  std::vector<double> values_;
  std::string_view message_;  // behind its head
  std::size_t at_ = 0;
  bool is_little_ = true;
};

std::optional<std::vector<double>> RosType::Read(const std::vector<std::vector<PlaceStep>>& places,
                                                 std::string_view message) const {
  return Walker(*this, places, message).Walk();
}

}  // namespace forereach
