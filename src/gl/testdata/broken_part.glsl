// The error stands on line 3.
vec4 part() {
  return undefinedName;
}
