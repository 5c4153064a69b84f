from interfaces import export

export("diagnostic_msgs", globals())
