// SPDX-License-Identifier: Apache-2.0
// Particle filter of static capacity: sequential importance sampling with any proposal, and the bootstrap filter with
// resampling. Source: Gordon, Salmond, Smith 1993; Doucet, Godsill, Andrieu, "On sequential Monte Carlo sampling
// methods for Bayesian filtering", Statistics and Computing 10, 2000.
#pragma once

#include "tetap/filter/particle_noise.hpp"
#include "tetap/filter/resampling.hpp"

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::filter {

/// x+ ~ p(x+ | x): from kNormals standard normals of this particle. valid(): states that are numbers stay numbers.
template <class M, class S>
concept ParticleMotion = requires(const M& motion, const S& x,
                                  const std::array<float, static_cast<std::size_t>(M::kNormals)>& normals) {
  { motion.sample(x, normals) } -> std::same_as<S>;
  { motion.valid() } -> std::same_as<bool>;
};

/// A particle that a proposal q(x+ | x, z) drew, with log( p(z | x+) p(x+ | x) / q(x+ | x, z) ).
template <class S>
struct Proposed {
  S x;
  float log_ratio;
};

template <class M, class S>
concept ParticleProposal = requires(const M& proposal, const S& x,
                                    const std::array<float, static_cast<std::size_t>(M::kNormals)>& normals) {
  { proposal.sample(x, normals) } -> std::same_as<Proposed<S>>;
  { proposal.valid() } -> std::same_as<bool>;
};

template <class S, std::size_t kMost_>
class Particles {
 public:
  static constexpr std::size_t kMost = kMost_;
  static constexpr int kBits = weight_bits(kMost);
  static_assert(kMost >= 2 && kMost <= 32'768, "indices and copies have 16 bits");
  /// The least log-weight that is kept.
  static constexpr float kLeast = -1e4F;

  constexpr Particles() = default;
  explicit constexpr Particles(base::PhiloxKey key) : key_(key) {}
  /// Key of the draws from now on.
  constexpr void set_key(base::PhiloxKey key) { key_ = key; }

  [[nodiscard]] constexpr std::size_t size() const { return size_; }
  [[nodiscard]] constexpr const S& operator[](std::size_t i) const { return states_[i]; }
  [[nodiscard]] constexpr std::span<const S> states() const { return {states_.data(), size_}; }
  /// Operations that drew numbers so far: the first word of their counters.
  [[nodiscard]] constexpr std::uint32_t epoch() const { return epoch_; }

  /// Log-weight less the largest.
  [[nodiscard]] constexpr float log_weight(std::size_t i) const { return equal_ ? 0.0F : log_weights_[i] - largest_; }
  /// Integer weight; the best has 2^weight_bits(kMost).
  [[nodiscard]] constexpr std::uint32_t integer_weight(std::size_t i) const {
    return equal_ ? 1U << kBits : weights_[i];
  }
  /// Weight as a share of the sum.
  [[nodiscard]] constexpr float weight(std::size_t i) const {
    return static_cast<float>(static_cast<std::int32_t>(integer_weight(i))) / sum();
  }

  /// Begins anew with `count` particles (at most kMost) of equal weight: make(draw) gives one from a Draw of its own.
  template <class Make>
  constexpr void fill(std::size_t count, const Make& make) {
    ++epoch_;
    size_ = count < 1 ? 1 : count > kMost ? kMost : count;
    for (std::size_t i = 0; i < size_; ++i)
      states_[i] = make(draw_of(key_, epoch_, static_cast<std::uint32_t>(i), DrawFor::kStart));
    make_equal();
  }

  /// Replaces every state by f of it: a change of coordinates, without a draw.
  template <class Function>
  constexpr void transform(const Function& f) {
    for (std::size_t i = 0; i < size_; ++i) states_[i] = f(states_[i]);
  }

  /// Implements docs/explanation/particle_filter.md (1).
  /// Moves every particle by a draw from the motion. False, and nothing has changed, when the motion is not valid.
  template <ParticleMotion<S> Motion>
  constexpr bool predict(const Motion& motion) {
    if (!motion.valid()) return false;
    ++epoch_;
    for_each_draw<Motion::kNormals>(
        [&](std::size_t i, const auto& normals) { states_[i] = motion.sample(states_[i], normals); });
    return true;
  }

  /// Implements docs/explanation/particle_filter.md (2).
  /// One step of sequential importance sampling with a proposal that has seen the measurement. False, and nothing has
  /// changed, when the proposal is not valid.
  template <ParticleProposal<S> Proposal>
  constexpr bool propose(const Proposal& proposal) {
    if (!proposal.valid()) return false;
    ++epoch_;
    for_each_draw<Proposal::kNormals>([&](std::size_t i, const auto& normals) {
      const Proposed<S> drawn = proposal.sample(states_[i], normals);
      states_[i] = drawn.x;
      log_weights_[i] = bounded((equal_ ? 0.0F : log_weights_[i] - largest_) + drawn.log_ratio);
    });
    equal_ = false;
    largest_ = 0.0F;
    weigh_by<false>([](std::size_t) { return 0.0F; });
    return true;
  }

  /// Multiplies each weight by exp(log_likelihood(x)). A log-likelihood that is no number counts as kLeast; where all
  /// do, all weights are equal afterwards. The logarithm of the mean likelihood under the weights before: the
  /// measurement's predictive density, within the rounding of the weights.
  template <class LogLikelihood>
  constexpr float weigh(const LogLikelihood& log_likelihood) {
    const float before = sum();
    if (equal_) {
      weigh_by<true>([&](std::size_t i) { return log_likelihood(states_[i]); });
    } else {
      weigh_by<false>([&](std::size_t i) { return log_likelihood(states_[i]); });
    }
    return largest_ + base::log(sum() / before);
  }

  /// Implements docs/explanation/particle_filter.md (4).
  /// Effective number of particles, (sum w)^2 / sum w^2 (Kong, Liu, Wong 1994): 1 to size().
  [[nodiscard]] constexpr float effective() const {
    std::uint64_t squares = 0;
    for (std::size_t i = 0; i < size_; ++i) squares += std::uint64_t{integer_weight(i)} * integer_weight(i);
    constexpr int kShift = 2 * kBits - 15;  // the largest weight alone leaves 16 bits, kMost of them 31
    const float denominator = static_cast<float>(static_cast<std::int32_t>(squares >> kShift)) * 0x1p-15F;
    const float numerator = sum() / static_cast<float>(std::int32_t{1} << kBits);
    return numerator * numerator / denominator;
  }

  /// `wanted` particles (1 to kMost) of equal weight, each in expectation in proportion to its weight.
  constexpr void resample(Resampling scheme, std::size_t wanted) {
    ++epoch_;
    wanted = wanted < 1 ? 1 : wanted > kMost ? kMost : wanted;
    const std::uint64_t seed = std::uint64_t{key_[1]} << 32 | key_[0];
    base::Random random(seed, std::uint64_t{static_cast<std::uint32_t>(DrawFor::kResampling)} << 32 | epoch_);
    if (equal_)
      for (std::size_t i = 0; i < size_; ++i) weights_[i] = 1U << kBits;
    count_copies(scheme, {weights_.data(), size_}, sum_, static_cast<std::uint32_t>(wanted), random,
                 {copies_.data(), size_});
    const std::size_t covered = size_ > wanted ? size_ : wanted;
    for (std::size_t i = size_; i < covered; ++i) copies_[i] = 0;
    place_copies<S>({states_.data(), covered}, {copies_.data(), covered}, wanted);
    size_ = wanted;
    make_equal();
  }

  /// Replaces about `share` of the particles by make(draw), each on a draw of its own; their weights become the mean
  /// weight when called after resample(). The number of replaced particles.
  template <class Make>
  constexpr std::size_t inject(float share, const Make& make) {
    ++epoch_;
    std::size_t replaced = 0;
    for (std::size_t i = 0; i < size_; ++i) {
      const Draw draw = draw_of(key_, epoch_, static_cast<std::uint32_t>(i), DrawFor::kInjection);
      if (!(draw.uniform(3) < share)) continue;
      states_[i] = make(draw);
      ++replaced;
    }
    return replaced;
  }

  /// Sum of weight(i) * value(x), in one fixed order.
  template <class Value>
  [[nodiscard]] constexpr float mean(const Value& value) const {
    float total = 0.0F;
    for (std::size_t i = 0; i < size_; ++i)
      total += static_cast<float>(static_cast<std::int32_t>(integer_weight(i))) * value(states_[i]);
    return total / sum();
  }

  /// The particle with most weight in its neighbourhood, among `candidates` particles evenly spaced by place. It is the
  /// mode of a kernel density with a box for kernel. near(a, b): is b in the neighbourhood of a?
  template <class Near>
  [[nodiscard]] constexpr std::size_t mode(std::size_t candidates, const Near& near) const {
    std::size_t best = 0;
    std::uint32_t most = 0;
    for (std::size_t k = 0; k < candidates; ++k) {
      const std::size_t c = k * size_ / candidates;
      std::uint32_t weight = 0;
      for (std::size_t i = 0; i < size_; ++i) weight += near(states_[c], states_[i]) ? integer_weight(i) : 0U;
      if (weight > most) most = weight, best = c;
    }
    return best;
  }

 private:
  [[nodiscard]] constexpr float sum() const { return static_cast<float>(static_cast<std::int32_t>(sum_ >> 1)) * 2.0F; }
  constexpr void make_equal() {
    equal_ = true;
    largest_ = 0.0F;
    sum_ = static_cast<std::uint32_t>(size_) << kBits;
  }
  [[nodiscard]] static constexpr float bounded(float log_weight) { return log_weight > kLeast ? log_weight : kLeast; }
  /// Implements docs/explanation/particle_filter.md (3).
  /// Adds a log-likelihood to each log-weight, the best of which is brought to zero before.
  template <bool kEqual, class LogLikelihood>
  constexpr void weigh_by(const LogLikelihood& log_likelihood) {
    const std::size_t size = size_;
    const float shift = largest_;
    float largest = kLeast;
    for (std::size_t i = 0; i < size; ++i) {
      const float before = kEqual ? 0.0F : log_weights_[i] - shift;
      const float after = bounded(before + log_likelihood(i));
      log_weights_[i] = after;
      largest = after > largest ? after : largest;
    }
    largest_ = largest;
    to_integers(largest);
  }
  /// Integer weights from log-weights, shifted so that the best becomes 2^kBits.
  constexpr void to_integers(float largest) {
    constexpr float kVanishes = -0.6931472F * static_cast<float>(kBits + 1);
    const std::size_t size = size_;
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const float relative = log_weights_[i] - largest;
      std::uint32_t w = 0;
      if (relative > kVanishes) {
        const base::detail::Scaled e = base::detail::exp_scaled(relative);
        const float scaled = base::from_bits(base::bits(e.value) + ((e.power + std::uint32_t{kBits}) << 23));
        const float raised = scaled + 0.5F;  // not negative: cutting it off rounds
        w = static_cast<std::uint32_t>(static_cast<std::int32_t>(raised));
      }
      weights_[i] = w;
      sum += w;
    }
    sum_ = sum;
    equal_ = false;
    if (sum == 0) make_equal();  // an infinite log-likelihood leaves no order
  }
  /// use(i, normals) for each particle: the numbers are those of normals_of<kNormals>().
  template <int kNormals, class Use>
  constexpr void for_each_draw(const Use& use) {
    const base::PhiloxKey key = key_;
    const std::uint32_t epoch = epoch_;
    const std::size_t size = size_;
    if constexpr (kNormals == 2) {
      for (std::size_t i = 0; i < size; i += 2) {
        const auto pair = static_cast<std::uint32_t>(i / 2);
        const base::PhiloxCounter words =
            base::philox({epoch, pair, 0, static_cast<std::uint32_t>(DrawFor::kMotion)}, key);
        const auto one = static_cast<std::uint32_t>(i), other = one + 1;
        use(i, std::array<float, 2>{normal_of(words[0], epoch, one, 0, key), normal_of(words[1], epoch, one, 1, key)});
        if (i + 1 < size)
          use(i + 1, std::array<float, 2>{normal_of(words[2], epoch, other, 0, key),
                                          normal_of(words[3], epoch, other, 1, key)});
      }
    } else {
      for (std::size_t i = 0; i < size; ++i) use(i, normals_of<kNormals>(key, epoch, static_cast<std::uint32_t>(i)));
    }
  }

  std::array<S, kMost> states_{};
  std::array<float, kMost> log_weights_{};
  std::array<std::uint32_t, kMost> weights_{};
  std::array<std::uint16_t, kMost> copies_{};
  std::size_t size_ = 0;
  float largest_ = 0.0F;
  std::uint32_t sum_ = 0;
  bool equal_ = true;  ///< all weights are one; the arrays of weights are not in use
  std::uint32_t epoch_ = 0;
  base::PhiloxKey key_{};
};

}  // namespace tetap::filter
