/** The equations of a nominal model as a program: a list of elementary operations for the values and for the first and
second derivatives.

The equations are a function template over the scalar type. Evaluated with Symbol, they record their operations.
Differentiate then adds every derivative that is not identically zero and shares equal subexpressions. All of this can
run at compile time. So the program of a model in the library is a constant, and its evaluation (expand.h) is
straight-line code. */
#pragma once

#include <array>
#include <cstddef>
#include <stdexcept>

#include "certifier/numerics/limits.h"
#include "certifier/numerics/size.h"

namespace forereach {

enum class Op : unsigned char {
  kVariable,     ///< z_a
  kParameter,    ///< parameter a, an exact double
  kConstant,     ///< `constant`
  kAdd,          ///< a + b
  kSubtract,     ///< a - b
  kMultiply,     ///< a b
  kDivide,       ///< a / b
  kNegate,       ///< -a
  kSquare,       ///< a^2
  kSin,          ///< sin a; its cosine is the next node
  kCos,          ///< cos a; its sine is the node before
  kTan,          ///< tan a; b is the sine of a
  kTanCurvature  ///< 2 a (1 + a^2): the second derivative of the tangent whose value is a
};

/** One operation. Its operands are earlier nodes. */
struct Operation {
  Op op = Op::kConstant;
  short a = -1, b = -1;
  double constant = 0;

  friend constexpr bool operator==(const Operation&, const Operation&) = default;
};

/** Nodes in the order of evaluation, and the lists of nodes that are the values, the Jacobian and the Hessians of f0.
Derivatives that are not listed are zero. */
struct Program {
  struct First {
    short row, column, node;
  };
  struct Second {
    short output, row, column, node;  // row <= column
  };
  static constexpr int kMaxOperations = 512, kMaxFirst = 128, kMaxSecond = 128;

  std::array<Operation, kMaxOperations> nodes{};
  int size = 0;
  std::array<short, kMaxStates> value{};
  short states = 0, variables = 0;
  std::array<First, kMaxFirst> jacobian{};
  int num_first = 0;
  std::array<Second, kMaxSecond> hessian{};
  int num_second = 0;

  /** @name The nodes that the evaluation of f0 and J at a point needs, and those that the Hessians over a box need. */
  ///@{
  std::array<bool, kMaxOperations> at_point{}, over_box{};
  ///@}

  [[nodiscard]] constexpr const Operation& node(int i) const { return nodes[ToSize(i)]; }
  [[nodiscard]] constexpr bool IsOne(int i) const { return node(i).op == Op::kConstant && node(i).constant == 1; }

  /** The index of the node with this operation. It adds a node unless an equal one exists. */
  constexpr short Add(const Operation& wanted) {
    for (int i = 0; i < size; ++i)
      if (node(i) == wanted) return static_cast<short>(i);
    if (size == kMaxOperations) throw std::length_error("program: too many operations");
    nodes[ToSize(size)] = wanted;
    return static_cast<short>(size++);
  }
  constexpr short Constant(double value_of) { return Add({Op::kConstant, -1, -1, value_of}); }
};

/** A scalar type that records the operations applied to it. */
class Symbol {
 public:
  constexpr Symbol() = default;
  constexpr Symbol(double constant) : constant_(constant) {}  // NOLINT: a number is an expression
  constexpr Symbol(Program* program, short node) : program_(program), node_(node) {}

  [[nodiscard]] constexpr short node() const { return node_; }

  friend constexpr Symbol operator+(Symbol a, Symbol b) { return Binary(Op::kAdd, a, b); }
  friend constexpr Symbol operator-(Symbol a, Symbol b) { return Binary(Op::kSubtract, a, b); }
  friend constexpr Symbol operator*(Symbol a, Symbol b) { return Binary(Op::kMultiply, a, b); }
  friend constexpr Symbol operator/(Symbol a, Symbol b) { return Binary(Op::kDivide, a, b); }
  friend constexpr Symbol operator-(Symbol a) { return a.Unary(Op::kNegate); }
  friend constexpr Symbol sin(Symbol a) { return {a.program_, a.AddSinCos()}; }
  friend constexpr Symbol cos(Symbol a) { return {a.program_, static_cast<short>(a.AddSinCos() + 1)}; }
  friend constexpr Symbol tan(Symbol a) {
    const short sine = a.AddSinCos();
    return {a.program_, a.program_->Add({Op::kTan, a.node_, sine})};
  }

 private:
  constexpr short AddSinCos() const {
    const short sine = program_->Add({Op::kSin, node_, -1});
    const short cosine = program_->Add({Op::kCos, node_, sine});
    if (cosine != sine + 1) throw std::logic_error("program: a sine without its cosine");
    return sine;
  }

  constexpr Symbol Unary(Op op) const { return {program_, program_->Add({op, node_, -1})}; }

  constexpr short In(Program& program) const { return program_ == nullptr ? program.Constant(constant_) : node_; }

  static constexpr Symbol Binary(Op op, const Symbol& a, const Symbol& b) {
    Program* program = a.program_ != nullptr ? a.program_ : b.program_;
    // Folding two numbers would round without an error bound.
    if (program == nullptr) throw std::logic_error("program: an operation on two constants");
    const short left = a.In(*program), right = b.In(*program);
    return {program, program->Add({op, left, right})};
  }

  Program* program_ = nullptr;
  short node_ = -1;
  double constant_ = 0;
};

namespace internal {

// Derivatives of a program's nodes; -1 means identically zero.
class Differentiation {
 public:
  constexpr explicit Differentiation(Program& program) : program_(program) {}

  constexpr short Of(short i, short variable) {
    const Operation n = program_.node(i);
    switch (n.op) {
      case Op::kVariable: return n.a == variable ? program_.Constant(1) : kZero;
      case Op::kParameter:
      case Op::kConstant: return kZero;
      case Op::kAdd: return Sum(Of(n.a, variable), Of(n.b, variable));
      case Op::kSubtract: return Sum(Of(n.a, variable), Negated(Of(n.b, variable)));
      case Op::kMultiply: return Sum(Product(n.a, Of(n.b, variable)), Product(Of(n.a, variable), n.b));
      case Op::kDivide: {  // (a' - (a / b) b') / b
        const short rest = Sum(Of(n.a, variable), Negated(Product(i, Of(n.b, variable))));
        return rest == kZero ? kZero : program_.Add({Op::kDivide, rest, n.b});
      }
      case Op::kNegate: return Negated(Of(n.a, variable));
      case Op::kSquare:  // occurs only in 1 + t^2 with a tangent t; half of its derivative is t t'
        return Product(program_.Constant(2), Product(n.a, Of(n.a, variable)));
      case Op::kSin: return Product(static_cast<short>(i + 1), Of(n.a, variable));
      case Op::kCos: return Product(Negated(static_cast<short>(i - 1)), Of(n.a, variable));
      case Op::kTan: return Product(TanSlope(i), Of(n.a, variable));
      case Op::kTanCurvature: break;
    }
    throw std::logic_error("program: a third derivative");
  }

  // Second derivatives: as Of, except that the slope 1 + t^2 of a tangent t has its own node, which is exact over
  // intervals.
  constexpr short OfSlope(short i, short variable) {
    const Operation n = program_.node(i);
    if (n.op == Op::kMultiply) return Sum(Product(n.a, OfSlope(n.b, variable)), Product(OfSlope(n.a, variable), n.b));
    if (n.op == Op::kAdd) {
      const Operation& square = program_.node(n.b);
      if (program_.IsOne(n.a) && square.op == Op::kSquare && program_.node(square.a).op == Op::kTan)
        return Product(program_.Add({Op::kTanCurvature, square.a, -1}), Of(program_.node(square.a).a, variable));
      return Sum(OfSlope(n.a, variable), OfSlope(n.b, variable));
    }
    if (n.op == Op::kNegate) return Negated(OfSlope(n.a, variable));
    return Of(i, variable);
  }

 private:
  static constexpr short kZero = -1;

  constexpr short TanSlope(short t) {
    const short square = program_.Add({Op::kSquare, t, -1});
    return program_.Add({Op::kAdd, program_.Constant(1), square});
  }
  constexpr short Sum(short a, short b) { return a == kZero ? b : b == kZero ? a : program_.Add({Op::kAdd, a, b}); }
  constexpr short Negated(short a) { return a == kZero ? kZero : program_.Add({Op::kNegate, a, -1}); }
  constexpr short Product(short a, short b) {
    if (a == kZero || b == kZero) return kZero;
    if (program_.IsOne(a)) return b;
    if (program_.IsOne(b)) return a;
    return program_.Add({Op::kMultiply, a, b});
  }

  Program& program_;
};

// Marks the nodes on which the nodes in `needed` depend. Over a box, a trigonometric function is expanded around its
// value at the center.
constexpr void MarkOperands(const Program& program, std::array<bool, Program::kMaxOperations>& needed) {
  for (int i = program.size - 1; i >= 0; --i) {
    const Operation& n = program.node(i);
    if (!needed[ToSize(i)] || n.op == Op::kVariable || n.op == Op::kParameter) continue;
    if (n.a >= 0) needed[ToSize(n.a)] = true;
    const bool has_second = n.op == Op::kAdd || n.op == Op::kSubtract || n.op == Op::kMultiply || n.op == Op::kDivide;
    if (has_second) needed[ToSize(n.b)] = true;
  }
}

constexpr void MarkTrigonometryAtPoint(Program& program) {
  for (int i = 0; i < program.size; ++i) {
    const Operation& n = program.node(i);
    const auto at = [&](int j) -> bool& { return program.at_point[ToSize(j)]; };
    if (program.over_box[ToSize(i)]) {
      if (n.op == Op::kSin) at(i) = at(i + 1) = true;
      if (n.op == Op::kCos) at(i) = at(i - 1) = true;
      if (n.op == Op::kTan) at(i) = true;
    }
  }
  for (int i = 0; i < program.size; ++i)  // a tangent at a point is sine over cosine
    if (program.node(i).op == Op::kTan && program.at_point[ToSize(i)]) {
      program.at_point[ToSize(program.node(i).b)] = true;
      program.at_point[ToSize(program.node(i).b + 1)] = true;
    }
}

}  // namespace internal

/** Adds the Jacobian and the Hessians to a program that has the values of f0. */
constexpr void Differentiate(Program& program) {
  internal::Differentiation d(program);
  for (short k = 0; k < program.states; ++k)
    for (short l = 0; l < program.variables; ++l) {
      const short node = d.Of(program.value[ToSize(k)], l);
      if (node < 0) continue;
      program.jacobian[ToSize(program.num_first++)] = {k, l, node};
      for (short i = 0; i <= l; ++i)
        if (const short second = d.OfSlope(node, i); second >= 0)
          program.hessian[ToSize(program.num_second++)] = {k, i, l, second};
    }
  for (int k = 0; k < program.states; ++k) program.at_point[ToSize(program.value[ToSize(k)])] = true;
  for (int e = 0; e < program.num_first; ++e) program.at_point[ToSize(program.jacobian[ToSize(e)].node)] = true;
  for (int e = 0; e < program.num_second; ++e) program.over_box[ToSize(program.hessian[ToSize(e)].node)] = true;
  internal::MarkOperands(program, program.over_box);
  internal::MarkTrigonometryAtPoint(program);
  internal::MarkOperands(program, program.at_point);
}

/** The program of a model's equations, a struct like KinematicBicycle (kinematic_bicycle.h). */
template <class Equations>
[[nodiscard]] constexpr Program MakeProgram() {
  Program program;
  program.states = Equations::kStates;
  program.variables = Equations::kStates + Equations::kInputs;
  std::array<Symbol, Equations::kStates + Equations::kInputs> z;
  std::array<Symbol, Equations::kStates> next;
  std::array<Symbol, Equations::kParameterNames.size()> parameters;
  for (short l = 0; l < program.variables; ++l) z[ToSize(l)] = {&program, program.Add({Op::kVariable, l, -1})};
  for (std::size_t p = 0; p < parameters.size(); ++p)
    parameters[p] = {&program, program.Add({Op::kParameter, static_cast<short>(p), -1})};
  Equations::template Step<Symbol>(parameters, z, next);
  for (std::size_t k = 0; k < next.size(); ++k) program.value[k] = next[k].node();
  Differentiate(program);
  return program;
}

}  // namespace forereach
