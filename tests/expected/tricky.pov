// A scene of the recursive ray tracing assignment, for POV-Ray 3.7
// Run: povray +Iscene.pov +Oscene.png +W64 +H48 -A -D -P +FN16 File_Gamma=1.0 +WT2
// The colours are linear: no gamma. Coordinates are the assignment's, times Unit.
// The scene as the assignment writes it:
//
//   10 200 90
//   0.3
//   3
//   255 0 0
//   5 5 90
//   8
//   0.5
//   0.25
//   0 255 0
//   0 0 300
//   40
//   1
//   1.5
//   0 0 255
//   0 0 300
//   40
//   0.2
//   0
//   2
//   200 100 50
//   0 0 400
//   0 3000 4000
//   0.5
//   0.75
//   60 70 80
//   0 -20 0
//   0 1 0
//   1
//   0.1

#version 3.7;
#declare Unit = 0.1;

global_settings {
  assumed_gamma 1.0
  max_trace_level 4  // the primary ray and 3 bounces
  adc_bailout 0             // no bounce is dropped for being faint
  ambient_light rgb <0.01171875, 0.234375, 0.10546875>  // ambient colour * coefficient / 256
}
background { rgb 0 }
camera {
  perspective
  location 0
  direction 100.0*z
  up 100.0*y
  right 100.0*x
}
light_source { <500.0, 500.0, 500.0>*Unit, rgb 1 }

// sphere 1, as the camera sees it
sphere { <5.0, 5.0, 90.0>*Unit, 8.0*Unit
  texture { pigment { rgb <255.0, 0.0, 0.0>/255 } finish { ambient 1 diffuse 0.5 specular 0 phong 0 reflection { 0.25 } } }
  interior_texture { pigment { rgb <255.0, 0.0, 0.0>/255 } finish { ambient 1 diffuse 0, 0.5 specular 0 phong 0 reflection { 0.25 } } }
  clipped_by { plane { -z, -100.0*Unit } }  // the camera sees nothing before the screen
  no_shadow no_reflection
}
// sphere 1, as shadows and mirrors see it
sphere { <5.0, 5.0, 90.0>*Unit, 8.0*Unit
  texture { pigment { rgb <255.0, 0.0, 0.0>/255 } finish { ambient 1 diffuse 0.5 specular 0 phong 0 reflection { 0.25 } } }
  interior_texture { pigment { rgb <255.0, 0.0, 0.0>/255 } finish { ambient 1 diffuse 0, 0.5 specular 0 phong 0 reflection { 0.25 } } }
  no_image
}

// sphere 2
sphere { <0.0, 0.0, 300.0>*Unit, 40.0*Unit
  texture { pigment { rgb <0.0, 255.0, 0.0>/255 } finish { ambient 1 diffuse 1.0 specular 0 phong 0 reflection { 1.5 } } }
  interior_texture { pigment { rgb <0.0, 255.0, 0.0>/255 } finish { ambient 1 diffuse 0, 1.0 specular 0 phong 0 reflection { 1.5 } } }
}

// plane 1
plane { <0.0, 0.6, 0.8>, 320.0*Unit
  texture { pigment { rgb <200.0, 100.0, 50.0>/255 } finish { ambient 1 diffuse 0.5 specular 0 phong 0 reflection { 0.75 } } }
  interior_texture { pigment { rgb <200.0, 100.0, 50.0>/255 } finish { ambient 1 diffuse 0, 0.5 specular 0 phong 0 reflection { 0.75 } } }
}

// plane 2, as the camera sees it
plane { <0.0, 1.0, 0.0>, -20.0*Unit
  texture { pigment { rgb <60.0, 70.0, 80.0>/255 } finish { ambient 1 diffuse 1.0 specular 0 phong 0 reflection { 0.1 } } }
  interior_texture { pigment { rgb <60.0, 70.0, 80.0>/255 } finish { ambient 1 diffuse 0, 1.0 specular 0 phong 0 reflection { 0.1 } } }
  clipped_by { plane { -z, -100.0*Unit } }  // the camera sees nothing before the screen
  no_shadow no_reflection
}
// plane 2, as shadows and mirrors see it
plane { <0.0, 1.0, 0.0>, -20.0*Unit
  texture { pigment { rgb <60.0, 70.0, 80.0>/255 } finish { ambient 1 diffuse 1.0 specular 0 phong 0 reflection { 0.1 } } }
  interior_texture { pigment { rgb <60.0, 70.0, 80.0>/255 } finish { ambient 1 diffuse 0, 1.0 specular 0 phong 0 reflection { 0.1 } } }
  no_image
}
