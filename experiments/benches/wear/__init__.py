"""Virtual machines that wear, whose physics is not the model's."""
