from interfaces import export

export("geometry_msgs", globals())
