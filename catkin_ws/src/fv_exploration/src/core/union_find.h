#pragma once
#include <algorithm>
#include <numeric>
#include <vector>

namespace fv {

/// Disjoint sets of 0..count-1; the root of a set is its least member.
class UnionFind {
 public:
  explicit UnionFind(int count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }

  int find(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void unite(int a, int b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }
  /// Number the sets by their least members. @param[out] number_of per member the number of its set.
  /// @return how many sets.
  int number(std::vector<int>& number_of) {
    number_of.resize(parent_.size());
    int sets = 0;
    for (int i = 0; i < static_cast<int>(parent_.size()); ++i) {
      const int root = find(i);
      number_of[i] = root == i ? sets++ : number_of[root];
    }
    return sets;
  }

 private:
  std::vector<int> parent_;
};

}  // namespace fv
