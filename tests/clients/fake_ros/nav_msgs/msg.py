from interfaces import export

export("nav_msgs", globals())
