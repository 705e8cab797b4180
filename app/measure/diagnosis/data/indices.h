// Typed indices of the diagnosis, and vectors that accept only their own index type.
#pragma once

#include <compare>
#include <concepts>
#include <cstddef>
#include <utility>
#include <vector>

namespace plumbline::measure {

/// Position in one kind of list, counted from 0. Indices of different kinds do not convert into
/// each other, nor into integers.
template <typename Tag>
class TypedIndex {
 public:
  constexpr TypedIndex() = default;
  template <std::integral Integer>
  constexpr explicit TypedIndex(Integer value) : value_(static_cast<int>(value)) {}

  /// For Eigen's subscripts and for messages.
  constexpr int value() const { return value_; }
  /// For subscripts of standard containers.
  constexpr std::size_t offset() const { return static_cast<std::size_t>(value_); }

  constexpr TypedIndex& operator++() {
    ++value_;
    return *this;
  }
  auto operator<=>(const TypedIndex&) const = default;  // NOLINT(modernize-use-nullptr)

 private:
  int value_ = 0;
};

using RowIndex = TypedIndex<struct RowTag>;  ///< row of a data set
using FitRowIndex =
    TypedIndex<struct FitRowTag>;  ///< position among the participating rows of a fit
using SessionIndex = TypedIndex<struct SessionTag>;
using ClusterIndex = TypedIndex<struct ClusterTag>;  ///< replicates of one pose
using SignalIndex = TypedIndex<struct SignalTag>;    ///< recorded signal of a data set
using BlockIndex = TypedIndex<struct BlockTag>;  ///< block of a candidate set or discrepancy model
using BlockColumnIndex = TypedIndex<struct BlockColumnTag>;  ///< column within its block
using ColumnIndex = TypedIndex<struct ColumnTag>;  ///< column of a candidate set, over all blocks

/// Half-open range of indices [first, last), for range-based loops.
template <typename Index>
class IndexRange {
 public:
  class Iterator {
   public:
    using value_type = Index;
    using difference_type = std::ptrdiff_t;
    constexpr Iterator() = default;
    constexpr explicit Iterator(Index at) : at_(at) {}
    constexpr Index operator*() const { return at_; }
    constexpr Iterator& operator++() {
      ++at_;
      return *this;
    }
    constexpr Iterator operator++(int) {
      const Iterator before = *this;
      ++at_;
      return before;
    }
    bool operator==(const Iterator&) const = default;

   private:
    Index at_;
  };

  constexpr IndexRange(Index first, Index last) : first_(first), last_(last) {}
  constexpr Iterator begin() const { return Iterator(first_); }
  constexpr Iterator end() const { return Iterator(last_); }

 private:
  Index first_, last_;
};

/// The first `count` indices.
template <typename Index, std::integral Integer>
constexpr IndexRange<Index> FirstIndices(Integer count) {
  return {Index(0), Index(count)};
}

/// A std::vector subscripted by one index type.
template <typename Index, typename T>
class Indexed : private std::vector<T> {
  using Items = std::vector<T>;

 public:
  using Items::Items;
  Indexed() = default;
  explicit Indexed(Items items) : Items(std::move(items)) {}

  using Items::assign;
  using Items::back;
  using Items::begin;
  using Items::clear;
  using Items::emplace_back;
  using Items::empty;
  using Items::end;
  using Items::front;
  using Items::push_back;
  using Items::reserve;
  using Items::resize;
  using Items::size;
  using typename Items::const_iterator;
  using typename Items::iterator;
  using typename Items::value_type;

  decltype(auto) operator[](Index index) { return Items::operator[](index.offset()); }
  decltype(auto) operator[](Index index) const { return Items::operator[](index.offset()); }

  int count() const { return static_cast<int>(size()); }
  IndexRange<Index> indices() const { return FirstIndices<Index>(size()); }
  const Items& items() const { return *this; }

  friend bool operator==(const Indexed& a, const Indexed& b) { return a.items() == b.items(); }
};

using FitRows = Indexed<FitRowIndex, RowIndex>;

template <typename T>
using PerRow = Indexed<RowIndex, T>;

}  // namespace plumbline::measure
