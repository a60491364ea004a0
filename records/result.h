/** Results of runs: added up field by field, and kept in the files of shards as JSON. */
#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "bus/authentic.h"
#include "records/event_log.h"
#include "records/log_trust.h"
#include "records/shard.h"

namespace forereach {

inline void AddField(bool& sum, bool more) { sum |= more; }
/** Of texts the first. */
inline void AddField(std::string& sum, std::string more) {
  if (sum.empty()) sum = std::move(more);
}
inline void AddField(nlohmann::json& sum, nlohmann::json more) { std::ranges::move(more, std::back_inserter(sum)); }
template <class Item>
void AddField(std::vector<Item>& sum, std::vector<Item> more) {
  std::ranges::move(more, std::back_inserter(sum));
}
template <class Key>
void AddField(std::map<Key, std::int64_t>& sum, const std::map<Key, std::int64_t>& more) {
  for (const auto& [key, count] : more) sum[key] += count;
}
template <class Number>
void AddField(Number& sum, const Number& more) {
  sum += more;
}

/** Lists the fields of a result, once for its sum and its JSON. */
#define FOREREACH_ADD_FIELD(field) AddField(sum.field, std::move(more.field));
#define FOREREACH_RESULT(Type, ...)                                             \
  NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Type, __VA_ARGS__)                         \
  inline Type& operator+=(Type& sum, Type more) {                               \
    NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(FOREREACH_ADD_FIELD, __VA_ARGS__)) \
    return sum;                                                                 \
  }

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Refusals, unsigned_ones, forged, replayed, foreign, old, ahead)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(PassedOver, not_authentic, undecodable)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LogDamage, places, bytes)

template <class Result>
void to_json(nlohmann::json& json, const CaseResults<Result>& results) {
  json = {{"of_run", results.of_run}, {"cases", results.cases}, {"counts", results.counts}, {"told", results.told}};
}
template <class Result>
void from_json(const nlohmann::json& json, CaseResults<Result>& results) {
  json.at("of_run").get_to(results.of_run);
  json.at("cases").get_to(results.cases);
  json.at("counts").get_to(results.counts);
  json.at("told").get_to(results.told);
}

}  // namespace forereach
