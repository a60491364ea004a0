#include "forereach/dynamics/compiled_models.h"

#include <stdexcept>
#include <tuple>

#include "forereach/dynamics/text_model.h"
#include "forereach/numerics/size.h"

namespace forereach {
namespace {

struct Compiled {
  const char* name;
  Program program;
  internal::MakeCompiled make;
};

std::vector<Compiled>& All() {
  static std::vector<Compiled> all;
  return all;
}

// The operations that the values need, each once, behind its operands, from the first value on: equal for programs that
// compute the same. Operands are places in this list.
std::vector<Operation> InOrderOfUse(const Program& program) {
  std::vector<Operation> ordered;
  std::vector<int> places(program.nodes.size(), -1), open;
  for (const int value : program.value) {
    open.push_back(value);
    while (!open.empty()) {
      const Operation& node = program.node(open.back());
      const auto waits_for = [&](bool has, int operand) {
        if (!has || places[ToSize(operand)] >= 0) return false;
        open.push_back(operand);
        return true;
      };
      if (places[ToSize(open.back())] < 0) {
        if (waits_for(node.has_first(), node.a) || waits_for(node.has_second(), node.b)) continue;
        Operation copy = node;
        if (node.has_first()) copy.a = places[ToSize(node.a)];
        if (node.has_second()) copy.b = places[ToSize(node.b)];
        if (node.op == Op::kSin || node.op == Op::kCos || node.op == Op::kTan) copy.b = -1;  // their own helpers
        places[ToSize(open.back())] = static_cast<int>(ordered.size());
        ordered.push_back(copy);
      }
      open.pop_back();
    }
  }
  for (const int value : program.value) ordered.push_back({Op::kVariable, places[ToSize(value)], -1, 0});
  return ordered;
}

}  // namespace

bool HaveSameValues(const Program& one, const Program& other) {
  return std::tuple(one.states, one.variables, one.value.size()) ==
             std::tuple(other.states, other.variables, other.value.size()) &&
         InOrderOfUse(one) == InOrderOfUse(other);
}

void internal::AddCompiled(const char* name, const Program& program, MakeCompiled make) {
  All().push_back({name, program, make});
}

std::shared_ptr<const NominalModel> CompiledFor(std::shared_ptr<const NominalModel> model) {
  std::string names;
  for (const Compiled& compiled : All()) {
    names += (names.empty() ? "" : ", ") + std::string(compiled.name);
    if (!model->program().nodes.empty() && HaveSameValues(model->program(), compiled.program) &&
        model->text() != nullptr) {
      const auto ranges = model->parameter_ranges();
      return compiled.make({ranges.begin(), ranges.end()},
                           {model->name(), model->state_names(), model->input_names(), model->parameter_names(),
                            std::make_shared<const ModelText>(*model->text()), model->angles()});
    }
  }
  if (names.empty()) return model;
  throw std::invalid_argument("the equations are not those that are compiled into this program, " + names +
                              ": write its header again with `forereach export-model`, and build it again");
}

}  // namespace forereach
