#include "gl/query.h"

#include <stdexcept>
#include <string>

#include "gl/context.h"

namespace catoptric::gl {

FragmentCounter::FragmentCounter(std::string_view label) {
  if (!Context::hasCurrent()) {
    throw std::logic_error("query \"" + std::string(label) + "\" made without a current context");
  }
  GLuint id = 0;
  glCreateQueries(GL_SAMPLES_PASSED, 1, &id);
  name_ = Name<ObjectKind::Query>(id, label);
}

void FragmentCounter::begin() const {
  glBeginQuery(GL_SAMPLES_PASSED, id());
}

void FragmentCounter::end() const {
  glEndQuery(GL_SAMPLES_PASSED);
}

std::uint64_t FragmentCounter::read() const {
  GLuint64 count = 0;
  glGetQueryObjectui64v(id(), GL_QUERY_RESULT, &count);
  return count;
}

}  // namespace catoptric::gl
