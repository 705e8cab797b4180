// Shapes of searched effects for a residual, as candidates of the search.
#include "app/diagnosis/search.h"
#include "app/diagnosis/shape_search.h"

namespace plumbline {

std::vector<int> AddShapes(Pool& pool, const std::vector<const Effect*>& searched,
                           const Eigen::VectorXd& residual) {
  std::vector<int> indices;
  for (const Effect* effect : searched) {
    for (const Block& block : ShapeSearchOf(*effect)->Propose(pool.problem(), residual)) {
      const int index = pool.Add(block);
      if (pool.Observable(index)) indices.push_back(index);
    }
  }
  return indices;
}

}  // namespace plumbline
