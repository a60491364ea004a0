/** The equations of a map as a program: a list of elementary operations for the values and for the first and second
derivatives.

Equations are written over a scalar type, as a function template or as text. Evaluated with Symbol, they record their
operations in a ProgramDraft. Differentiate then adds every derivative that is not identically zero and shares equal
subexpressions. All of this can run at compile time: the program of a model in the library is a constant, and its
evaluation (expand.h) is straight-line code. The program of a text is made when the text is read (text_model.h) and
evaluated by interpretation (program_model.h), with the same operations in the same order. */
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <vector>

#include "forereach/numerics/limits.h"
#include "forereach/numerics/size.h"

namespace forereach {

enum class Op : unsigned char {
  kVariable,      ///< z_a
  kParameter,     ///< parameter a
  kConstant,      ///< `constant`
  kAdd,           ///< a + b
  kSubtract,      ///< a - b
  kMultiply,      ///< a b
  kDivide,        ///< a / b
  kNegate,        ///< -a
  kSquare,        ///< a^2
  kSin,           ///< sin a; its cosine is the next node
  kCos,           ///< cos a; its sine is the node before
  kTan,           ///< tan a; b is the sine of a
  kTanCurvature,  ///< 2 a (1 + a^2): the second derivative of the tangent whose value is a
  kPower,         ///< a^b, where b is the exponent itself, a whole number
  kSqrt,          ///< sqrt a
  kExp,           ///< e^a
  kLog,           ///< log a
  kAsin,          ///< asin a
  kAcos,          ///< acos a
  kAtan,          ///< atan a
  kAtan2,         ///< atan2(a, b), the angle of the point (b, a) in (-pi, pi]
  kTanh,          ///< tanh a
  kAbs,           ///< |a|
  kSignedSquare,  ///< a |a|
  kMin,           ///< min(a, b)
  kMax,           ///< max(a, b)
  kSign,          ///< 1 where a > 0, -1 where a < 0
  kStep,          ///< 1 where a > 0, 0 where a < 0
  kSlopeOfAbs,    ///< kSign in second derivatives: where |a| < kNearZero, from -1 to 1
  kKink,          ///< 0 where a is not 0, and no number at 0: the derivative of kSign and kStep
  kCut,           ///< 0, and no number where a = 0 and b <= 0: the jump of atan2(a, b)
  kSoftplus,      ///< b log(1 + e^(a/b)); has no derivative here, so it is for residuals only
  kSmoothGate     ///< e^(-1/a) where a > 0, 0 elsewhere; likewise
};

/** Plain arithmetic does not tell the sign of a number that is nearer to zero. */
inline constexpr double kNearZero = 0x1p-30;

/** One operation. Its operands are earlier nodes. */
struct Operation {
  Op op = Op::kConstant;
  int a = -1, b = -1;
  double constant = 0;

  /** Whether b is an operand. In kCos and kTan it is a node that is evaluated together with this one. */
  [[nodiscard]] constexpr bool has_second() const {
    return op == Op::kAdd || op == Op::kSubtract || op == Op::kMultiply || op == Op::kDivide || op == Op::kAtan2 ||
           op == Op::kMin || op == Op::kMax || op == Op::kCut || op == Op::kSoftplus;
  }
  /** Whether a is an operand. */
  [[nodiscard]] constexpr bool has_first() const {
    return op != Op::kVariable && op != Op::kParameter && op != Op::kConstant;
  }

  friend constexpr bool operator==(const Operation& one, const Operation& other) {
    return one.op == other.op && one.a == other.a && one.b == other.b &&
           std::bit_cast<std::uint64_t>(one.constant) == std::bit_cast<std::uint64_t>(other.constant);
  }
};

/** Nodes in the order of evaluation, and the lists of nodes that are the values, the Jacobian and the Hessians of a map
from z = (x, u) to a list of numbers; that of a model has `states` of them. Derivatives that are not listed are zero.
Second derivatives are those by states: inputs are points. The lists belong to a FixedProgram or a ProgramDraft. */
struct Program {
  struct First {
    short row = 0, column = 0;
    int node = -1;
    bool is_one = false;  // identically 1
  };
  struct Second {
    short output = 0, row = 0, column = 0;  // row <= column
    int node = -1;
  };
  /** The longest lists that there can be. */
  static constexpr int kMaxFirst = kMaxStates * kMaxVariables,
                       kMaxSecond = kMaxStates * (kMaxStates * (kMaxStates + 1) / 2);

  std::span<const Operation> nodes{};
  int size = 0;
  std::span<const int> value{};
  short states = 0, variables = 0;
  std::span<const First> jacobian{};
  int num_first = 0;
  std::span<const Second> hessian{};
  int num_second = 0;

  /** @name The nodes that the evaluation of f0 and J at a point needs, and those that the Hessians over a box need. */
  ///@{
  std::span<const unsigned char> at_point{}, over_box{};
  ///@}

  [[nodiscard]] constexpr const Operation& node(int i) const { return nodes[ToSize(i)]; }
};

/** Marks with 1, among nodes in the order of evaluation, those on which the marked nodes depend. */
constexpr void MarkOperands(std::span<const Operation> nodes, std::vector<unsigned char>& needed) {
  for (std::size_t i = nodes.size(); i-- > 0;) {
    const Operation& n = nodes[i];
    if (needed[i] == 0) continue;
    if (n.has_first()) needed[ToSize(n.a)] = 1;
    if (n.has_second()) needed[ToSize(n.b)] = 1;
  }
}

/** A program that grows. */
class ProgramDraft final {
 public:
  /** Their values fit on the stack of any thread. More could not be evaluated in the time of a step. */
  static constexpr int kMaxOperations = 1 << 16;

  constexpr ProgramDraft(int states, int variables)
      : states_(static_cast<short>(states)), variables_(static_cast<short>(variables)) {}

  [[nodiscard]] constexpr int size() const { return static_cast<int>(nodes_.size()); }
  [[nodiscard]] constexpr const Operation& node(int i) const { return nodes_[ToSize(i)]; }
  [[nodiscard]] constexpr bool IsOne(int i) const { return node(i).op == Op::kConstant && node(i).constant == 1; }

  /** The index of the node with this operation. It adds a node unless an equal one exists. @throws
  std::invalid_argument above kMaxOperations. */
  constexpr int Add(const Operation& wanted) {
    if (2 * nodes_.size() >= places_.size()) Grow();
    std::size_t place = HashOf(wanted);
    while (places_[place] >= 0) {
      if (node(places_[place]) == wanted) return places_[place];
      place = (place + 1) % places_.size();
    }
    static_assert(kMaxOperations == 65536);  // the message says so
    if (size() == kMaxOperations) throw std::invalid_argument("equations: more than 65536 operations");
    places_[place] = size();
    nodes_.push_back(wanted);
    return places_[place];
  }
  constexpr int Constant(double value_of) { return Add({Op::kConstant, -1, -1, value_of}); }

  /** Node k is the value of output k. */
  constexpr void SetValues(std::span<const int> nodes) { value_.assign(nodes.begin(), nodes.end()); }

  /** Adds the Jacobian and the Hessians. @pre SetValues. @throws std::invalid_argument for an operation without
  derivative. */
  constexpr void Differentiate();

  /** Replaces each value by its derivative by a parameter. @pre SetValues, and no Differentiate before. @throws as
  Differentiate. */
  constexpr void DifferentiateBy(int parameter) {
    std::vector<unsigned char> wanted(nodes_.size(), 0);
    for (const int node : value_) wanted[ToSize(node)] = 1;
    MarkOperands(nodes_, wanted);
    const Derivatives d = DifferentiateAll(static_cast<short>(-1 - parameter), wanted, false);
    for (int& node : value_) node = d[ToSize(node)] == kZero ? Constant(0) : d[ToSize(node)];
  }

  /** Refers to this draft, which must not change while it is used. @pre Differentiate, or no derivative is used. */
  [[nodiscard]] constexpr Program View() const {
    return {nodes_,
            size(),
            value_,
            states_,
            variables_,
            jacobian_,
            static_cast<int>(jacobian_.size()),
            hessian_,
            static_cast<int>(hessian_.size()),
            at_point_,
            over_box_};
  }

 private:
  // By its index, the derivative of each node by one variable, or by parameter p as variable -1 - p; kZero: identically
  // zero.
  static constexpr int kZero = -1;
  using Derivatives = std::vector<int>;

  constexpr Derivatives DifferentiateAll(short variable, std::span<const unsigned char> wanted, bool slopes);
  constexpr int DerivativeOf(int i, short variable, const Derivatives& d, bool slopes);

  constexpr std::size_t HashOf(const Operation& n) const {
    std::uint64_t h = std::bit_cast<std::uint64_t>(n.constant) ^ static_cast<std::uint64_t>(n.op) << 56;
    h = (h ^ static_cast<std::uint64_t>(static_cast<std::uint32_t>(n.a))) * 0x9e3779b97f4a7c15u;
    h = (h ^ h >> 29 ^ static_cast<std::uint64_t>(static_cast<std::uint32_t>(n.b))) * 0xbf58476d1ce4e5b9u;
    return static_cast<std::size_t>(h >> 20) % places_.size();
  }
  constexpr void Grow() {
    places_.assign(places_.empty() ? 64 : 2 * places_.size(), -1);
    for (int i = 0; i < size(); ++i) {
      std::size_t place = HashOf(node(i));
      while (places_[place] >= 0) place = (place + 1) % places_.size();
      places_[place] = i;
    }
  }

  constexpr int TanSlope(int t) { return Add({Op::kAdd, Constant(1), Add({Op::kSquare, t, -1})}); }
  constexpr int Sum(int a, int b) { return a == kZero ? b : b == kZero ? a : Add({Op::kAdd, a, b}); }
  constexpr int Negated(int a) { return a == kZero ? kZero : Add({Op::kNegate, a, -1}); }
  constexpr int Product(int a, int b) {
    if (a == kZero || b == kZero) return kZero;
    if (IsOne(a)) return b;
    if (IsOne(b)) return a;
    return Add({Op::kMultiply, a, b});
  }
  constexpr int Quotient(int a, int b) { return a == kZero ? kZero : Add({Op::kDivide, a, b}); }

  constexpr void MarkAtPoint();

  std::vector<Operation> nodes_;
  std::vector<int> places_;  // a hash table of the nodes, with linear probing; -1: free
  std::vector<int> value_;
  std::vector<Program::First> jacobian_;
  std::vector<Program::Second> hessian_;
  std::vector<unsigned char> at_point_, over_box_;
  short states_, variables_;
};

/** A scalar type that records the operations applied to it. */
class Symbol {
 public:
  constexpr Symbol() = default;
  constexpr Symbol(double constant) : constant_(constant) {}  // NOLINT: a number is an expression
  constexpr Symbol(ProgramDraft* program, int node) : program_(program), node_(node) {}

  /** Variable l or parameter p of the program. */
  [[nodiscard]] static constexpr Symbol Variable(ProgramDraft& program, int l) {
    return {&program, program.Add({Op::kVariable, l, -1})};
  }
  [[nodiscard]] static constexpr Symbol Parameter(ProgramDraft& program, int p) {
    return {&program, program.Add({Op::kParameter, p, -1})};
  }
  [[nodiscard]] static constexpr Symbol Constant(ProgramDraft& program, double constant) {
    return {&program, program.Constant(constant)};
  }

  [[nodiscard]] constexpr int node() const { return node_; }

  friend constexpr Symbol operator+(Symbol a, Symbol b) { return Binary(Op::kAdd, a, b); }
  friend constexpr Symbol operator-(Symbol a, Symbol b) { return Binary(Op::kSubtract, a, b); }
  friend constexpr Symbol operator*(Symbol a, Symbol b) { return Binary(Op::kMultiply, a, b); }
  friend constexpr Symbol operator/(Symbol a, Symbol b) { return Binary(Op::kDivide, a, b); }
  friend constexpr Symbol operator-(Symbol a) { return a.Unary(Op::kNegate); }
  friend constexpr Symbol sqr(Symbol a) { return a.Unary(Op::kSquare); }
  friend constexpr Symbol sin(Symbol a) { return {a.program_, a.AddSinCos()}; }
  friend constexpr Symbol cos(Symbol a) { return {a.program_, a.AddSinCos() + 1}; }
  friend constexpr Symbol tan(Symbol a) {
    const int sine = a.AddSinCos();
    return {a.program_, a.program_->Add({Op::kTan, a.node_, sine})};
  }
  /** a^n. */
  friend constexpr Symbol pow(Symbol a, int n) {
    if (n == 0) return {a.program_, a.program_->Constant(1)};
    if (n == 1) return a;
    if (n == 2) return sqr(a);
    return {a.program_, a.program_->Add({Op::kPower, a.node_, n})};
  }
  friend constexpr Symbol sqrt(Symbol a) { return a.Unary(Op::kSqrt); }
  friend constexpr Symbol exp(Symbol a) { return a.Unary(Op::kExp); }
  friend constexpr Symbol log(Symbol a) { return a.Unary(Op::kLog); }
  friend constexpr Symbol asin(Symbol a) { return a.Unary(Op::kAsin); }
  friend constexpr Symbol acos(Symbol a) { return a.Unary(Op::kAcos); }
  friend constexpr Symbol atan(Symbol a) { return a.Unary(Op::kAtan); }
  friend constexpr Symbol atan2(Symbol y, Symbol x) { return Binary(Op::kAtan2, y, x); }
  friend constexpr Symbol tanh(Symbol a) { return a.Unary(Op::kTanh); }
  friend constexpr Symbol abs(Symbol a) { return a.Unary(Op::kAbs); }
  friend constexpr Symbol SignedSquare(Symbol a) { return a.Unary(Op::kSignedSquare); }
  friend constexpr Symbol min(Symbol a, Symbol b) { return Binary(Op::kMin, a, b); }
  friend constexpr Symbol max(Symbol a, Symbol b) { return Binary(Op::kMax, a, b); }
  friend constexpr Symbol Softplus(Symbol x, Symbol temperature) { return Binary(Op::kSoftplus, x, temperature); }
  friend constexpr Symbol SmoothGate(Symbol a) { return a.Unary(Op::kSmoothGate); }

 private:
  constexpr int AddSinCos() const {
    const int sine = program_->Add({Op::kSin, node_, -1});
    const int cosine = program_->Add({Op::kCos, node_, sine});
    if (cosine != sine + 1) throw std::logic_error("program: a sine without its cosine");
    return sine;
  }

  constexpr Symbol Unary(Op op) const { return {program_, program_->Add({op, node_, -1})}; }

  constexpr int In(ProgramDraft& program) const { return program_ == nullptr ? program.Constant(constant_) : node_; }

  static constexpr Symbol Binary(Op op, const Symbol& a, const Symbol& b) {
    ProgramDraft* program = a.program_ != nullptr ? a.program_ : b.program_;
    // Folding two numbers would round without an error bound.
    if (program == nullptr) throw std::logic_error("program: an operation on two constants");
    const int left = a.In(*program), right = b.In(*program);
    return {program, program->Add({op, left, right})};
  }

  ProgramDraft* program_ = nullptr;
  int node_ = -1;
  double constant_ = 0;
};

// The derivatives of all wanted nodes by one variable. `slopes`: the slope 1 + t^2 of a tangent t has its own
// derivative, which is exact over intervals; and they are second derivatives, in which |a| has kSlopeOfAbs.
constexpr ProgramDraft::Derivatives ProgramDraft::DifferentiateAll(short variable,
                                                                   std::span<const unsigned char> wanted, bool slopes) {
  Derivatives d(wanted.size(), kZero);
  for (int i = 0; i < static_cast<int>(wanted.size()); ++i)
    if (wanted[ToSize(i)] != 0) d[ToSize(i)] = DerivativeOf(i, variable, d, slopes);
  return d;
}

constexpr int ProgramDraft::DerivativeOf(int i, short variable, const Derivatives& d, bool slopes) {
  const Operation n = node(i);
  const int da = n.has_first() ? d[ToSize(n.a)] : kZero, db = n.has_second() ? d[ToSize(n.b)] : kZero;
  switch (n.op) {
    case Op::kVariable: return n.a == variable ? Constant(1) : kZero;
    case Op::kParameter: return n.a == -1 - variable ? Constant(1) : kZero;
    case Op::kConstant: return kZero;
    case Op::kAdd:
      if (slopes && IsOne(n.a)) {
        const Operation square = node(n.b);
        if (square.op == Op::kSquare && node(square.a).op == Op::kTan)
          return Product(Add({Op::kTanCurvature, square.a, -1}), d[ToSize(node(square.a).a)]);
      }
      return Sum(da, db);
    case Op::kSubtract: return Sum(da, Negated(db));
    case Op::kMultiply: return Sum(Product(n.a, db), Product(da, n.b));
    case Op::kDivide:  // (a' - (a / b) b') / b
      return Quotient(Sum(da, Negated(Product(i, db))), n.b);
    case Op::kNegate: return Negated(da);
    case Op::kSquare: return da == kZero ? kZero : Product(Constant(2), Product(n.a, da));
    case Op::kSin: return Product(i + 1, da);
    case Op::kCos: return da == kZero ? kZero : Product(Negated(i - 1), da);
    case Op::kTan: return da == kZero ? kZero : Product(TanSlope(i), da);
    case Op::kTanCurvature: break;
    case Op::kPower:  // n a^(n-1) a'
      return da == kZero ? kZero : Product(Constant(n.b), Product(pow(Symbol(this, n.a), n.b - 1).node(), da));
    case Op::kSqrt: return da == kZero ? kZero : Quotient(da, Add({Op::kMultiply, Constant(2), i}));
    case Op::kExp: return Product(i, da);
    case Op::kLog: return Quotient(da, n.a);
    case Op::kAsin:
    case Op::kAcos: {
      if (da == kZero) return kZero;
      const int cosine = Add({Op::kSqrt, Add({Op::kSubtract, Constant(1), Add({Op::kSquare, n.a, -1})}), -1});
      const int slope = Quotient(da, cosine);
      return n.op == Op::kAsin ? slope : Negated(slope);
    }
    case Op::kAtan:
      return da == kZero ? kZero : Quotient(da, Add({Op::kAdd, Constant(1), Add({Op::kSquare, n.a, -1})}));
    case Op::kAtan2: {  // (b a' - a b') / (a^2 + b^2), and no number on the cut
      if (da == kZero && db == kZero) return kZero;
      const int size = Add({Op::kAdd, Add({Op::kSquare, n.a, -1}), Add({Op::kSquare, n.b, -1})});
      return Sum(Quotient(Sum(Product(n.b, da), Negated(Product(n.a, db))), size), Add({Op::kCut, n.a, n.b}));
    }
    case Op::kTanh:
      return da == kZero ? kZero : Product(Add({Op::kSubtract, Constant(1), Add({Op::kSquare, i, -1})}), da);
    case Op::kAbs: return da == kZero ? kZero : Product(Add({slopes ? Op::kSlopeOfAbs : Op::kSign, n.a, -1}), da);
    case Op::kSignedSquare: return da == kZero ? kZero : Product(Constant(2), Product(Add({Op::kAbs, n.a, -1}), da));
    case Op::kMin:
    case Op::kMax: {
      if (da == kZero && db == kZero) return kZero;
      const int above = Add({Op::kStep, Add({Op::kSubtract, n.a, n.b}), -1});
      const int below = Add({Op::kStep, Add({Op::kSubtract, n.b, n.a}), -1});
      const bool is_max = n.op == Op::kMax;
      return Sum(Product(is_max ? above : below, da), Product(is_max ? below : above, db));
    }
    case Op::kSign:
    case Op::kStep:
    case Op::kSlopeOfAbs:
    case Op::kKink: return da == kZero ? kZero : Product(Add({Op::kKink, n.a, -1}), da);
    case Op::kCut: return da == kZero && db == kZero ? kZero : i;
    case Op::kSoftplus:
    case Op::kSmoothGate:
      if (da == kZero && db == kZero) return kZero;
      throw std::invalid_argument("softplus and smooth_gate are for residuals: a nominal model needs derivatives");
  }
  throw std::logic_error("program: a third derivative");
}

// Marks in at_point_, which has the values and the Jacobian, what they are made of.
constexpr void ProgramDraft::MarkAtPoint() {
  const auto at = [&](int j) -> unsigned char& { return at_point_[ToSize(j)]; };
  for (int i = 0; i < size(); ++i) {  // over a box, a trigonometric function is expanded around its value at the center
    if (over_box_[ToSize(i)] == 0) continue;
    if (node(i).op == Op::kSin) at(i) = at(i + 1) = 1;
    if (node(i).op == Op::kCos) at(i) = at(i - 1) = 1;
    if (node(i).op == Op::kTan) at(i) = 1;
  }
  MarkOperands(nodes_, at_point_);
  for (int i = 0; i < size(); ++i)  // a tangent is sine over cosine; all three have the same operand
    if (node(i).op == Op::kTan && at(i) != 0) at(node(i).b) = at(node(i).b + 1) = 1;
}

constexpr void ProgramDraft::Differentiate() {
  std::vector<unsigned char> wanted(nodes_.size(), 0);
  for (const int node : value_) wanted[ToSize(node)] = 1;
  MarkOperands(nodes_, wanted);
  for (short k = 0; ToSize(k) < value_.size(); ++k)
    for (short l = 0; l < variables_; ++l) jacobian_.push_back({k, l, kZero, false});
  for (short l = 0; l < variables_; ++l) {
    const Derivatives d = DifferentiateAll(l, wanted, false);
    for (Program::First& entry : jacobian_)
      if (entry.column == l) entry.node = d[ToSize(value_[ToSize(entry.row)])];
  }
  std::erase_if(jacobian_, [](const Program::First& entry) { return entry.node == kZero; });
  for (Program::First& entry : jacobian_) entry.is_one = IsOne(entry.node);

  wanted.assign(nodes_.size(), 0);
  for (const Program::First& entry : jacobian_)
    if (entry.column < states_) wanted[ToSize(entry.node)] = 1;
  MarkOperands(nodes_, wanted);
  std::vector<Derivatives> by_state;
  for (short l = 0; l < states_; ++l) by_state.push_back(DifferentiateAll(l, wanted, true));
  for (const Program::First& entry : jacobian_)
    for (short i = 0; i <= entry.column && entry.column < states_; ++i)
      if (const int second = by_state[ToSize(i)][ToSize(entry.node)]; second != kZero)
        hessian_.push_back({entry.row, i, entry.column, second});

  at_point_.assign(nodes_.size(), 0);
  over_box_.assign(nodes_.size(), 0);
  for (const int node : value_) at_point_[ToSize(node)] = 1;
  for (const Program::First& entry : jacobian_) at_point_[ToSize(entry.node)] = 1;
  for (const Program::Second& entry : hessian_) over_box_[ToSize(entry.node)] = 1;
  MarkOperands(nodes_, over_box_);
  MarkAtPoint();
}

/** A program in arrays, for compile time. */
template <std::size_t kNodes, std::size_t kFirst, std::size_t kSecond, std::size_t kOutputs>
struct FixedProgram {
  std::array<Operation, kNodes> nodes{};
  std::array<int, kOutputs> value{};
  std::array<Program::First, kFirst> jacobian{};
  std::array<Program::Second, kSecond> hessian{};
  std::array<unsigned char, kNodes> at_point{}, over_box{};
  short variables = 0;

  constexpr explicit FixedProgram(const Program& program) : variables(program.variables) {
    const auto copy = [](const auto& from, auto& to) {
      for (std::size_t i = 0; i < to.size(); ++i) to[i] = from[i];
    };
    copy(program.nodes, nodes);
    copy(program.value, value);
    copy(program.jacobian, jacobian);
    copy(program.hessian, hessian);
    copy(program.at_point, at_point);
    copy(program.over_box, over_box);
  }

  [[nodiscard]] constexpr Program View() const {
    return {nodes,   static_cast<int>(kNodes), value, kOutputs, variables, jacobian, kFirst, hessian, kSecond, at_point,
            over_box};
  }
};

/** The draft of a model's equations, a struct like KinematicBicycle (models/kinematic_bicycle.h). */
template <class Equations>
[[nodiscard]] constexpr ProgramDraft DraftOf() {
  constexpr int kVariables = Equations::kStates + Equations::kInputs;
  ProgramDraft program(Equations::kStates, kVariables);
  std::array<Symbol, kVariables> z;
  std::array<Symbol, Equations::kStates> next;
  std::array<Symbol, Equations::kParameterNames.size()> parameters;
  for (int l = 0; l < kVariables; ++l) z[ToSize(l)] = Symbol::Variable(program, l);
  for (std::size_t p = 0; p < parameters.size(); ++p) parameters[p] = Symbol::Parameter(program, static_cast<int>(p));
  Equations::template Step<Symbol>(parameters, z, next);
  std::array<int, Equations::kStates> values{};
  for (std::size_t k = 0; k < next.size(); ++k) values[k] = next[k].node();
  program.SetValues(values);
  program.Differentiate();
  return program;
}

/** The program of a model's equations, as a constant. */
template <class Equations>
class ProgramOf {
  struct Sizes {
    std::size_t nodes, first, second;
  };
  static constexpr Sizes kSizes = [] {
    const ProgramDraft draft = DraftOf<Equations>();
    const Program program = draft.View();
    return Sizes{program.nodes.size(), program.jacobian.size(), program.hessian.size()};
  }();
  static constexpr auto kFixed = [] {
    const ProgramDraft draft = DraftOf<Equations>();
    return FixedProgram<kSizes.nodes, kSizes.first, kSizes.second, Equations::kStates>(draft.View());
  }();

 public:
  static constexpr Program kProgram = kFixed.View();
};

}  // namespace forereach
