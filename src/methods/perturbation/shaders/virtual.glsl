// Of objects where a reflector shows them.
//   PLACES  1: by way of several reflectors, with the places of the last reflection
VARYING vec3 vertexPosition;  // the real one
VARYING float vertexShare;    // |x - eye| / |image - eye|, x the place of the reflection
#if PLACES
VARYING vec3 vertexPlace;     // where the last reflector shows it
#endif
