"""A snake robot in a lumen: constraint pathway, proximity query, conformance, bending and control.

K.-W. Kwok, K. H. Tsoi, V. Vitiello, J. Clark, G. C. T. Chow, W. Luk and G.-Z. Yang, "Dimensionality reduction in
controlling articulated snake robot for endoscopy under dynamic active constraints", IEEE Transactions on Robotics
29(1), 2013. Numbers of equations in this package are that paper's: "Kwok 2013, eq. 7".

Everything is in the patient frame (LPS), mm, rad and s. In code links, joints, contours and segments count from 0;
segment j lies between contours j and j + 1.
"""

NOTICE = "Not for clinical use."
