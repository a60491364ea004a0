/** Makes libFuzzer change a JSON document where it means something, as well as its bytes: hardly any change of a byte
leaves a document that gets past the parser. To be included by the one source file of a target. */
#pragma once

#include <cmath>
#include <iterator>
#include <utility>

#include <nlohmann/json.hpp>

#include "fuzz/mutator.h"

namespace forereach {

class JsonMutator final {
 public:
  using Json = nlohmann::ordered_json;

  explicit JsonMutator(std::minstd_rand& random) : random_(random) {}

  void Change(Json& document) {
    Json& place = AnyPlace(document);
    switch (Below(8)) {
      case 0: place = AnyPlace(document); return;
      case 1: return RemoveEntry(place);
      case 2: return AddEntry(place, AnyPlace(document));
      case 3: std::swap(AnyEntry(place), AnyEntry(place)); return;
      default: place = OtherValue(place); return;
    }
  }

 private:
  Json::iterator AnyIn(Json& value) {
    return std::next(value.begin(), static_cast<Json::difference_type>(Below(value.size())));
  }

  // An entry of a list or map; the value itself if it has none.
  Json& AnyEntry(Json& value) {
    if (!value.is_structured() || value.empty()) return value;
    return *AnyIn(value);
  }

  Json& AnyPlace(Json& document) {
    Json* place = &document;
    while (place->is_structured() && !place->empty() && Below(8) > 0) place = &AnyEntry(*place);
    return *place;
  }

  void RemoveEntry(Json& value) {
    if (value.is_structured() && !value.empty()) value.erase(AnyIn(value));
  }

  void AddEntry(Json& value, Json entry) {
    if (value.is_array())
      value.insert(value.begin() + static_cast<Json::difference_type>(Below(value.size() + 1)), std::move(entry));
    if (value.is_object()) value["another"] = std::move(entry);
  }

  Json OtherValue(const Json& value) {
    if (value.is_number() && Below(2) > 0) return OtherNumber(value.get<double>());
    const Json other[] = {nullptr,       true,          "", "\n", 0, -1, 1024, 9007199254740993, 1e308, -5e-324,
                          Json::array(), Json::object()};
    return other[Below(std::size(other))];
  }

  double OtherNumber(double number) {
    const double other[] = {
        -number, 2 * number, 0.5 * number, number + 1, std::nextafter(number, 1e308), std::nextafter(number, -1e308)};
    return other[Below(std::size(other))];
  }

  std::size_t Below(std::size_t end) { return random_() % end; }

  std::minstd_rand& random_;
};

}  // namespace forereach

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  using Json = forereach::JsonMutator::Json;
  return forereach::MutateText(data, size, max_size, seed, [](std::string_view text, std::minstd_rand& random) {
    Json document = Json::parse(text, nullptr, false);
    if (document.is_discarded()) return std::string();
    forereach::JsonMutator(random).Change(document);
    return document.dump(-1, ' ', false, Json::error_handler_t::replace);
  });
}
